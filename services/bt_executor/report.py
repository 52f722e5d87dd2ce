"""A mission as others see it: its nodes and its blackboard as plain data."""

from __future__ import annotations

import math
from typing import Any

from bus_schema import codec
from bus_schema.annotations import PlainValue
from bus_schema.errors import SchemaError
from bus_schema.messages.mission import MissionNode, MissionStatus, NodeStatus
from services.bt_executor.engine import Blackboard, Node, Tree, status_name
from services.bt_executor.mission import Mission

LONGEST_TEXT = 2000
DEEPEST = 6


def mission_status(mission: Mission, now: float) -> MissionStatus:
    """Return a mission's status; ``now`` is its stamp in seconds."""
    tree = mission.tree
    return MissionStatus(
        now,
        mission.state,
        tree.tree_id if tree else "",
        mission.ticks,
        _nodes(tree) if tree else (),
        shown_blackboard(tree.blackboard) if tree else {},
        mission.running_leaves(),
        mission.error,
    )


def _nodes(tree: Tree) -> tuple[MissionNode, ...]:
    parents = {child.uid: node.uid for node in tree.nodes for child in node.children}
    return tuple(_node(node, parents.get(node.uid, 0)) for node in tree.nodes)


def _node(node: Node, parent: int) -> MissionNode:
    return MissionNode(
        node.uid,
        parent,
        node.name,
        node.type_id,
        node.path,
        NodeStatus(status_name(node.status).lower()),
        dict(node.setup.attributes),
    )


def shown_blackboard(board: Blackboard) -> dict[str, PlainValue]:
    """Return a board's values as plain data to be looked at; what is no plain data is shown as text."""
    return {key: _shown(value, 0) for key, value in board.dump().items()}


def _shown(value: Any, depth: int) -> PlainValue:
    if is_plain(value):
        return value
    if isinstance(value, float):
        return str(value)
    if depth < DEEPEST:
        if isinstance(value, list | tuple):
            return [_shown(item, depth + 1) for item in value]
        if isinstance(value, dict):
            return {str(key): _shown(item, depth + 1) for key, item in value.items()}
        try:
            return _shown(codec.to_plain(value), depth + 1)
        except SchemaError:
            pass
    return str(value)[:LONGEST_TEXT].encode("utf-8", "replace").decode()


def kept_blackboard(board: Blackboard) -> dict[str, PlainValue]:
    """Return the values of a board that are plain data, for a snapshot."""
    return {key: value for key, value in board.dump().items() if value is not None and is_plain(value)}


def is_plain(value: Any, depth: int = 0) -> bool:
    """Tell whether a value can travel as plain data and be the same afterwards."""
    if isinstance(value, float):
        return not math.isnan(value)
    if isinstance(value, list) and depth < DEEPEST:
        return all(is_plain(item, depth + 1) for item in value)
    if isinstance(value, dict) and depth < DEEPEST:
        return all(is_plain(key) and isinstance(key, str) and is_plain(item, depth + 1) for key, item in value.items())
    if isinstance(value, int) and not isinstance(value, bool):
        return -(2**63) <= value < 2**63
    if isinstance(value, str):
        return len(value) <= LONGEST_TEXT and _is_unicode(value)
    return value is None or isinstance(value, bool)


def _is_unicode(text: str) -> bool:
    """Tell whether text can be encoded; JSON may hold halves of characters."""
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True
