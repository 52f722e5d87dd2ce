"""Makes trees from XML."""

import sys
from collections.abc import Sequence
from pathlib import Path

from .clock import Clock, MonotonicClock
from .data.blackboard import Blackboard
from .library import TreeLibrary
from .mocking import mock_unknown_types
from .node_registry import Registry
from .nodes.limits import Limits
from .nodes.runtime import Runtime
from .tree import Tree
from .xml.builder import Builder
from .xml.checks import check_structure, total_size
from .xml.collection import Collector, TreeCollection

_FRAMES_PER_LEVEL = 5
_FRAMES_OF_CALLERS = 400


def load_file(
    path: str | Path,
    registry: Registry,
    *,
    main: str = "",
    clock: Clock | None = None,
    blackboard: Blackboard | None = None,
    search_path: Sequence[Path] = (),
    lenient: bool = True,
    strict: bool = False,
    mock_unknown: bool = False,
    limits: Limits | None = None,
    library: TreeLibrary | None = None,
) -> Tree:
    """Make a tree from a file.

    Args:
        path: The file.
        registry: The node types.
        main: The ID of the tree to execute; by default the file's.
        clock: Where timing nodes take the time from; by default the machine's monotonic clock.
        blackboard: The top blackboard, if it exists already; it gets the registry's converters.
        search_path: Folders that hold the packages named by ``<include ros_pkg="…">``; a package that the
            including file is in is found without.
        lenient: Whether to read ill-formed XML that BehaviorTree.CPP reads too, with a warning; see `mending`.
        strict: Whether scripts may use only what BehaviorTree.CPP's can: no names of statuses, no functions.
        mock_unknown: Whether a node type that is not registered gets a mock, with a warning: by its model in a
            TreeNodesModel, else by how it is used; see `mock_models`.
        limits: How large the tree may be, if that is to be checked before any node is made.
        library: Where sub-trees are that the file does not have.

    Raises:
        LoadError: The tree cannot be built; names file and line.
    """
    collector = Collector(search_path, lenient, limits)
    collector.add_file(Path(path))
    collector.check_ids()
    return _build(collector.collection, registry, main, clock, blackboard, mock_unknown, limits, strict, library)


def load_text(
    text: str,
    registry: Registry,
    *,
    main: str = "",
    clock: Clock | None = None,
    blackboard: Blackboard | None = None,
    search_path: Sequence[Path] = (),
    lenient: bool = True,
    strict: bool = False,
    mock_unknown: bool = False,
    limits: Limits | None = None,
    folder: Path | None = None,
    library: TreeLibrary | None = None,
) -> Tree:
    """Make a tree from XML text; relative includes start from a folder, by default the current one.

    See `load_file` for the other arguments.
    """
    collector = Collector(search_path, lenient, limits)
    collector.add_own_text(text, folder or Path())
    collector.check_ids()
    return _build(collector.collection, registry, main, clock, blackboard, mock_unknown, limits, strict, library)


def load_from_library(
    tree_id: str,
    library: TreeLibrary,
    registry: Registry,
    *,
    clock: Clock | None = None,
    blackboard: Blackboard | None = None,
    strict: bool = False,
    mock_unknown: bool = False,
    limits: Limits | None = None,
) -> Tree:
    """Make a tree of a library by its ID; only the trees that it uses are looked at.

    See `load_file` for the other arguments.

    Raises:
        LoadError: There is no such tree, or it cannot be built.
    """
    if tree_id not in library.ids:
        raise library.missing(tree_id)
    return _build(TreeCollection(), registry, tree_id, clock, blackboard, mock_unknown, limits, strict, library)


def _build(
    collection: TreeCollection,
    registry: Registry,
    main: str,
    clock: Clock | None,
    blackboard: Blackboard | None,
    mock_unknown: bool,
    limits: Limits | None,
    strict: bool,
    library: TreeLibrary | None,
) -> Tree:
    if library is not None:
        # Chosen before trees of the library make a choice among several of it.
        main = main or collection.named_main or collection.main_tree("")
        library.complete(collection, main)
    if mock_unknown:
        registry = registry.copy()
        mock_unknown_types(registry, collection)
    main = collection.main_tree(main)
    check_structure(collection, registry.manifests)
    size = total_size(collection, main, limits.text if limits else None)
    if limits:
        limits.check(main, size)
    _allow_recursion(size.depth)
    clock = clock or (blackboard.clock if blackboard else MonotonicClock())
    board = blackboard or Blackboard(clock=clock)
    board.converters = registry.converters
    runtime = Runtime(clock, registry.enums, extensions=not strict)
    builder = Builder(collection, registry, runtime, seconds=limits.seconds if limits else None)
    builder.build_tree(main, board, "")
    # A sub-tree whose path is the tree's ID goes first: the top board is at hand as the tree's own.
    boards = {main: board, **builder.boards}
    return Tree(
        main,
        nodes=tuple(builder.nodes),
        blackboards=boards,
        runtime=runtime,
        warnings=tuple(collection.warnings),
    )


def _allow_recursion(depth: int) -> None:
    """Raise Python's limit for trees that are nested so deeply that a tick would exceed it."""
    needed = depth * _FRAMES_PER_LEVEL + _FRAMES_OF_CALLERS
    if needed > sys.getrecursionlimit():
        sys.setrecursionlimit(needed)
