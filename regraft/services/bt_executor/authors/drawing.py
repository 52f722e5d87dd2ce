"""``regraft mission models`` and ``dot``: node types for editors, and trees as graphs."""

from __future__ import annotations

from regraft.cli.stack.drawing import GraphOption, show_graph
from regraft.cli.terminal.output import complain, say
from regraft.services.bt_executor.authors.options import MainOption, NodesOption, StackOption, TreeFile, TreesOption


def models(nodes: NodesOption = None, stack: StackOption = None) -> None:
    """Print the models of all node types that a mission can use, for editors such as Groot2."""
    # The engine is loaded only here: every command of regraft pays for the imports at the top.
    from behavior_tree.xml.model_text import models_text
    from regraft.services.bt_executor.authors.known_types import known_to_authors

    doubts: list[str] = []
    known = known_to_authors(nodes or [], stack, None, doubts)
    for doubt in doubts:
        complain(f"warning: {doubt}")
    say(models_text(known.registry.manifests.values()))


def dot(
    file: TreeFile,
    main: MainOption = "",
    nodes: NodesOption = None,
    stack: StackOption = None,
    trees: TreesOption = None,
    out: GraphOption = None,
) -> None:
    """Draw a tree as a graph, in Graphviz's language or as a picture; unknown node types are drawn as they are used."""
    from behavior_tree import dot as graphviz
    from regraft.services.bt_executor.authors.known_types import known_to_authors, library_known
    from regraft.services.bt_executor.authors.reading import loaded

    doubts: list[str] = []
    known = known_to_authors(nodes or [], stack, file, doubts)
    tree = loaded(file, known, main, library=library_known(trees, stack))
    for doubt in (*doubts, *tree.warnings):
        complain(f"warning: {doubt}")
    show_graph(graphviz.dot(tree), out)
