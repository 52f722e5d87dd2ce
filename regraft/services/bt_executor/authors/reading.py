"""Loads a mission file for commands that do not run it on a robot."""

from __future__ import annotations

from pathlib import Path

from behavior_tree import ManualClock, Tree, TreeError, TreeLibrary, load_file
from regraft.cli.outcomes import BadInput
from regraft.services.bt_executor.checking import KnownNodes
from regraft.services.bt_executor.source import LIMITS, check_size


def loaded(
    file: Path, known: KnownNodes, main: str, clock: ManualClock | None = None, library: TreeLibrary | None = None
) -> Tree:
    """Return a file's tree; node types that are not known get mocks, with a warning.

    Args:
        file: The file.
        known: The node types that are known.
        main: The ID of the tree, by default that of the file.
        clock: The tree's source of time.
        library: Where sub-trees are that the file does not have.

    Raises:
        BadInput: it cannot be built; the text names file, line and node.
    """
    board = known.root_board(clock)
    types = known.registry
    try:
        tree = load_file(file, types, main=main, blackboard=board, mock_unknown=True, limits=LIMITS, library=library)
        check_size(tree)
    except TreeError as error:
        node = f" (node '{error.node}')" if error.node and error.node not in str(error) else ""
        raise BadInput(f"{error}{node}") from None
    return tree
