"""Finds the node types and trees that commands about mission files know, in folders and stacks of their authors."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from pathlib import Path

from behavior_tree import TreeError, TreeLibrary
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.robots.executors import executors
from regraft.cli.outcomes import BadInput
from regraft.cli.terminal.output import complain
from regraft.process.main import load_class
from regraft.process.trial.trial_import import check_imports
from regraft.services.bt_executor.checking import KnownNodes, known_nodes
from regraft.services.bt_executor.executor import Executor
from regraft.services.bt_executor.source import Unloadable, library_of
from regraft.stack import load
from regraft.stack.classes import look_in
from regraft.stack.installed import stack_file


def known_to_authors(nodes: Collection[str], stack: Path | None, file: Path | None, doubts: list[str]) -> KnownNodes:
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
    given = _executors(stack) if stack is not None else ()
    places = list(dict.fromkeys([*nodes, *_nodes_of(given)]))
    check_imports((place.partition(":")[0] for place in places if ":" in place), complain)
    try:
        return known_nodes(places, doubts, _classes(given) or (Executor,))
    except TreeError as error:
        raise BadInput(str(error)) from None


def library_known(trees: Iterable[Path] | None, stack: Path | None) -> TreeLibrary:
    """Return the trees of installed packages, at paths of the command line, and those that a stack's executors know.

    Raises:
        BadInput: a path leads nowhere, or the library is too large.
        StackError: the stack cannot be loaded.
    """
    given = [*(trees or ()), *(_given(_executors(stack), "trees") if stack is not None else ())]
    try:
        return library_of(dict.fromkeys(map(str, given)))
    except Unloadable as error:
        raise BadInput(str(error)) from None


def _nodes_of(given: Iterable[ComponentSpec]) -> Iterable[str]:
    """Yield where executors find further node types."""
    for places in _given(given, "nodes"):
        yield from places.split()


def _given(given: Iterable[ComponentSpec], parameter: str) -> Iterable[str]:
    """Yield a parameter of each executor, where it is given."""
    yield from (str(spec.parameters[parameter]) for spec in given if spec.parameters.get(parameter))


def _classes(given: Iterable[ComponentSpec]) -> Sequence[type[Executor]]:
    """Return the classes of executors; a program that runs missions has none of ours."""
    classes = dict.fromkeys(load_class(spec.cls) for spec in given if spec.cls)
    return [cls for cls in classes if issubclass(cls, Executor)]


def _executors(stack: Path) -> Sequence[ComponentSpec]:
    """Return the components of a stack that run missions. Raises BadInput where there is none, and StackError."""
    found = load(stack_file(stack), complain)
    look_in(found.folder)
    components = found.architecture.components
    running = executors(components, found.architecture.scopes)
    if not running:
        raise BadInput(f"--stack {stack}: no component runs missions: name a stack with a mission executor")
    return [components[executor.component] for executor in running]
