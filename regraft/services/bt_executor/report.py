"""A mission as others see it."""

from __future__ import annotations

from behavior_tree import Blackboard
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.mission import MissionStatus
from regraft.bus_schema.messages.quality import Quality
from regraft.services.bt_executor.debugging.breakpoint_requests import shown_stop
from regraft.services.bt_executor.mission import Mission
from regraft.services.bt_executor.plain_values import is_plain, shown, shown_text


def mission_status(mission: Mission, qualities: tuple[Quality, ...], now: float) -> MissionStatus:
    """Return a mission's status, with the latest of its quality requirements; ``now`` is its stamp in seconds."""
    tree = mission.tree
    return MissionStatus(
        now,
        mission.state,
        tree.tree_id if tree else "",
        mission.ticks,
        mission.nodes(),
        shown_blackboard(tree.blackboard) if tree else {},
        mission.running_leaves(),
        shown_text(mission.error),
        mission.structure,
        qualities,
        shown_stop(mission.debugging.stop),
    )


def shown_blackboard(board: Blackboard) -> dict[str, PlainValue]:
    """Return a board's values as plain data to be looked at; what is no plain data is shown as text."""
    return {key: shown(value) for key, value in board.dump().items()}


def kept_blackboard(board: Blackboard) -> dict[str, PlainValue]:
    """Return the values of a board that are plain data, for a snapshot."""
    return {key: value for key, value in board.dump().items() if value is not None and is_plain(value)}
