"""The five statuses of a behaviour-tree node.

Statuses are plain integers with a type of their own: comparing the members of an ``enum.IntEnum`` costs
several times as much, and a tick does little else. The numbers are those of BehaviorTree.CPP and of Groot2's
protocol.
"""

from typing import Final, NewType

Status = NewType("Status", int)

IDLE: Final = Status(0)
RUNNING: Final = Status(1)
SUCCESS: Final = Status(2)
FAILURE: Final = Status(3)
SKIPPED: Final = Status(4)

COMPLETED: Final = (SUCCESS, FAILURE)
"""The results of a node that is done."""
STORED: Final = (RUNNING, SUCCESS, FAILURE)
"""The results that a node keeps; SKIPPED is for the parent only."""

STATUS_NAMES: Final = ("IDLE", "RUNNING", "SUCCESS", "FAILURE", "SKIPPED")


def status_name(status: Status) -> str:
    """Return a status's name in capitals, such as ``RUNNING``."""
    return STATUS_NAMES[status]


def status_from_name(name: str) -> Status:
    """Return the status of a name.

    Raises:
        ValueError: There is no status of this name.
    """
    try:
        return Status(STATUS_NAMES.index(name.strip()))
    except ValueError:
        raise ValueError(f"'{name}' is not a status; use one of {', '.join(STATUS_NAMES)}") from None
