"""Checks a mission file without a system: what is wrong with its trees, and where.

The loader stops at the first error. To find the others, an element at fault is replaced by an inert one, and the tree
is loaded again. This ends when it loads, or when an error has no place.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Final, cast
from xml.sax.saxutils import quoteattr

from behavior_tree import (
    Blackboard,
    ManualClock,
    NodeManifest,
    Registry,
    Tree,
    TreeError,
    TreeLibrary,
    UnknownTypeError,
    load_file,
    load_text,
    read_manifests,
)
from behavior_tree.mocking import mock_models
from behavior_tree.xml.document import Element, parse_document
from behavior_tree.xml.encoding import decode
from regraft import Kit
from regraft.component.component import describe
from regraft.services.bt_executor.adaptation.reactive_parents import repeated_adaptations
from regraft.services.bt_executor.executor import Executor
from regraft.services.bt_executor.leaves.context import LeafContext
from regraft.services.bt_executor.node_types import NODE_TYPES, node_types
from regraft.services.bt_executor.source import LIMITS, check_size, warnings_of

MAX_ERRORS: Final = 20
MAX_MODELS_SIZE: Final = 1_000_000
"""Bytes of a file with models of nodes."""
HARMLESS: Final = "AlwaysSuccess"


@dataclass(frozen=True, slots=True)
class Finding:
    """Something that is wrong: file, line (0 where there is none), the node's path, name or type, and what it is."""

    file: str
    line: int
    node: str
    text: str

    def __str__(self) -> str:
        """Return it as a line."""
        place = f"{self.file}:{self.line}: " if self.line else f"{self.file}: "
        node = f"node '{self.node}': " if self.node and f"'{self.node}'" not in self.text else ""
        return f"{place}{node}{self.text}"


@dataclass(frozen=True, slots=True)
class Report:
    """The findings; ``tree`` and ``nodes`` are the name and size of the loaded tree, if it is right."""

    errors: tuple[Finding, ...]
    warnings: tuple[str, ...]
    tree: str = ""
    nodes: int = 0


class _Nobody:
    """Replaces the executor's kit where nothing runs: leaves may ask for its inputs' names, and for no more."""

    def __init__(self, executors: Sequence[type[Executor]]) -> None:
        ports = (port for executor in executors for port in describe(executor).ports)
        self.inputs = {port.name: None for port in ports if port.direction == "input"}


@dataclass(frozen=True, slots=True)
class KnownNodes:
    """The node types that a tree may use, and the classes of the executors that are to run it."""

    registry: Registry
    executors: Sequence[type[Executor]] = (Executor,)

    def root_board(self, clock: ManualClock | None = None) -> Blackboard:
        """Return a root blackboard with the entries that the executors have of themselves."""
        board = Blackboard(clock=clock or ManualClock())
        types = {own.key: own.type for executor in self.executors for own in executor.reflected}
        for key, kind in types.items():
            board.declare(key, kind)
        return board


def known_nodes(
    places: Sequence[str], warnings: list[str] | None = None, executors: Sequence[type[Executor]] = (Executor,)
) -> KnownNodes:
    """Return the node types that executors know, and others: as ``module:name``, or a file with a TreeNodesModel.

    Args:
        places: Where the others are.
        warnings: Takes the doubts about models, each with file and line.
        executors: The classes of the executors.

    Raises:
        TreeError: a place leads nowhere, or a file holds no models.
    """
    files = [place for place in places if Path(place).suffix.lower() in (".xml", ".btproj")]
    classes = [place for place in places if place not in files]
    models = [model for file in files for model in _models(file, warnings)]
    context = LeafContext(cast("Kit", _Nobody(executors)), lambda: None)
    ours = node_types(context, classes).manifests
    # A model of the same name with other ports is of somebody else's node, which its mission means.
    others = [
        model.type_id for model in models if model.type_id in NODE_TYPES and model.ports.keys() != _ports(ours, model)
    ]
    registry = node_types(context, classes, leave_out=others)
    mock_models(registry, models)
    return KnownNodes(registry, executors)


def _ports(known: Mapping[str, NodeManifest], model: NodeManifest) -> Set[str]:
    return known[model.type_id].ports.keys()


def _models(file: str, warnings: list[str] | None) -> Collection[NodeManifest]:
    try:
        with Path(file).open("rb") as stream:
            data = stream.read(MAX_MODELS_SIZE + 1)
        if len(data) > MAX_MODELS_SIZE:
            raise TreeError(f"'{file}' is too large: must have at most {MAX_MODELS_SIZE} bytes", file=file)
        text = decode(data)
    except (OSError, ValueError) as error:
        raise TreeError(f"cannot read '{file}': {error}", file=file) from error
    manifests = read_manifests(text, file, warnings)
    if not manifests:
        raise TreeError(f"'{file}' has no <TreeNodesModel> with node types", file=file)
    return manifests.values()


def check(
    file: Path, known: KnownNodes, main: str = "", *, strict: bool = False, library: TreeLibrary | None = None
) -> Report:
    """Return all mistakes in a file's tree ``main``, by default the one that it executes.

    If ``strict``, the scripts may have only what those of BehaviorTree.CPP have. Sub-trees may be those of ``library``.
    """
    first = _outcome(lambda: _from_file(file, known, main, strict, library), file)
    if isinstance(first, Report):
        return first
    if first.line == 0:
        return Report((first,), ())
    try:
        document = parse_document(decode(file.read_bytes()), "")
    except (TreeError, OSError, ValueError):
        return Report((first,), ())
    report = _Search(file, known, main, strict, library).run(document, first)
    in_order = sorted(report.errors, key=lambda error: (error.file != str(file), error.file, error.line))
    return replace(report, errors=tuple(in_order))


def _from_file(file: Path, known: KnownNodes, main: str, strict: bool, library: TreeLibrary | None) -> Tree:
    board = known.root_board()
    return load_file(file, known.registry, main=main, blackboard=board, limits=LIMITS, strict=strict, library=library)


def _outcome(made: Callable[[], Tree], file: Path) -> Report | Finding:
    try:
        return _right(made())
    except TreeError as error:
        return _finding(error, file)


def _right(tree: Tree) -> Report:
    check_size(tree)
    warnings = (*warnings_of(tree), *repeated_adaptations(tree))
    return Report((), warnings, tree.tree_id, len(tree.nodes))


def _finding(error: TreeError, file: Path) -> Finding:
    place = error.file if error.file and Path(error.file) != file.resolve() else str(file)
    # Both forms of the file's name in one text would make one error look like two.
    text = error.message.replace(f"{file.resolve()}:", f"{file}:").replace("<text>:", f"{file}:")
    if isinstance(error, UnknownTypeError) and not error.hint:
        text += "; name its class or its model with --nodes"
    return Finding(place, error.line, error.node, text)


class _Search:
    """Looks for further errors in a document."""

    def __init__(self, file: Path, known: KnownNodes, main: str, strict: bool, library: TreeLibrary | None) -> None:
        self._strict = strict
        self._library = library
        self._file = file
        self._known = known
        self._main = main

    def run(self, document: Element, first: Finding) -> Report:
        found = [first]
        while len(found) < MAX_ERRORS:
            mended, outcome = self._mended(document, found[-1])
            if mended is None:
                return Report(tuple(found), ())
            if isinstance(outcome, Report):
                named = tuple(warning.replace("<text>", str(self._file), 1) for warning in outcome.warnings)
                return Report(tuple(found), named)
            document = mended
            found.append(outcome)
        return Report(tuple(found), ())

    def _mended(self, document: Element, error: Finding) -> tuple[Element | None, Report | Finding]:
        """Return the document without what has this error, and what comes then; None if it stays."""
        if error.file == str(self._file):
            for culprit in _suspects(document, error.line):
                without = _replaced(document, culprit)
                outcome = self._loaded(without)
                if isinstance(outcome, Report) or (outcome.line, outcome.text) != (error.line, error.text):
                    return without, outcome
        return None, error

    def _loaded(self, document: Element) -> Report | Finding:
        text = "".join(_texts(document, [1]))
        load = partial(load_text, text, self._known.registry, main=self._main, limits=LIMITS, strict=self._strict)
        load = partial(load, library=self._library)
        return _outcome(partial(load, blackboard=self._known.root_board(), folder=self._file.parent), self._file)


def _elements(element: Element) -> Iterator[Element]:
    pending = [element]
    while pending:
        found = pending.pop()
        yield found
        pending.extend(reversed(found.children))


def _suspects(document: Element, line: int) -> list[Element]:
    """Return the elements of trees that begin in a line, those with the least inside first."""
    inside = (found for tree in document.children_of("BehaviorTree") for found in _elements(tree))
    on_line = [element for element in inside if element.line == line and element.tag != HARMLESS]
    return sorted(on_line, key=lambda element: sum(1 for _ in _elements(element)))


def _replaced(element: Element, culprit: Element) -> Element:
    """Return a copy in which every element that equals the culprit, in the same line, does nothing."""
    if (element.line, element.tag, element.attributes) == (culprit.line, culprit.tag, culprit.attributes):
        nothing = Element(HARMLESS, {}, element.file, element.line)
        if element.tag != "BehaviorTree":
            return nothing
        return Element(element.tag, element.attributes, element.file, element.line, [nothing])
    children = [_replaced(child, culprit) for child in element.children]
    return Element(element.tag, element.attributes, element.file, element.line, children)


def _texts(element: Element, line: list[int]) -> Iterator[str]:
    """Yield XML in which every element is in its line; ``line`` holds the line that is being written."""
    yield "\n" * (element.line - line[0])
    line[0] = max(line[0], element.line)
    yield f"<{element.tag}"
    for name, value in element.attributes.items():
        yield f" {name}={_quoted(value)}"
    yield ">"
    for child in element.children:
        yield from _texts(child, line)
    yield f"</{element.tag}>"


def _quoted(value: str) -> str:
    return quoteattr(value, {"\n": "&#10;", "\r": "&#13;", "\t": "&#9;"})
