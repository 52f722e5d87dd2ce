"""Finds the node types and trees that commands about mission files know, in folders and stacks of their authors."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from pathlib import Path

from behavior_tree import Registry, TreeError, TreeLibrary
from regraft.bus_schema.model.robots.executors import executors
from regraft.cli.outcomes import BadInput
from regraft.cli.terminal.output import complain
from regraft.process.trial.trial_import import check_imports
from regraft.services.bt_executor.checking import known_types
from regraft.services.bt_executor.source import Unloadable, library_of
from regraft.stack import load
from regraft.stack.classes import look_in
from regraft.stack.installed import stack_file


def known_to_authors(nodes: Collection[str], stack: Path | None, file: Path | None, doubts: list[str]) -> Registry:
    """Return the node types at places of the command line, and those that a stack's executors know.

    Args:
        nodes: Files with models, or ``module:name``.
        stack: The stack, None for none.
        file: A mission file, whose folder may have modules.
        doubts: Takes the doubts about models, each with file and line.

    Raises:
        BadInput: a place leads nowhere, or a file has no models.
        StackError: the stack cannot be loaded.
    """
    if file is not None:
        look_in(file.resolve().parent)
    look_in(Path.cwd())
    places = list(dict.fromkeys([*nodes, *(_nodes_of(stack) if stack is not None else ())]))
    check_imports((place.partition(":")[0] for place in places if ":" in place), complain)
    try:
        return known_types(places, doubts)
    except TreeError as error:
        raise BadInput(str(error)) from None


def library_known(trees: Iterable[Path] | None, stack: Path | None) -> TreeLibrary:
    """Return the trees of installed packages, at paths of the command line, and those that a stack's executors know.

    Raises:
        BadInput: a path leads nowhere, or the library is too large.
        StackError: the stack cannot be loaded.
    """
    given = [*(trees or ()), *(_given(stack, "trees") if stack is not None else ())]
    try:
        return library_of(dict.fromkeys(map(str, given)))
    except Unloadable as error:
        raise BadInput(str(error)) from None


def _nodes_of(stack: Path) -> Iterable[str]:
    """Yield where the executors of a stack find further node types."""
    for places in _given(stack, "nodes"):
        yield from places.split()


def _given(stack: Path, parameter: str) -> Iterable[str]:
    """Yield a parameter of each executor of a stack, where it is given."""
    found = load(stack_file(stack), complain)
    look_in(found.folder)
    components = found.architecture.components
    running = executors(components, found.architecture.topics)
    if not running:
        raise BadInput(f"--stack {stack}: no component runs missions: name a stack with a mission executor")
    values = (components[executor.component].parameters.get(parameter) for executor in running)
    yield from (str(value) for value in values if value)
