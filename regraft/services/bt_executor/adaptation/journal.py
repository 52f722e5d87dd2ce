"""The record for the journal of the moment in which an adaptation was decided."""

from __future__ import annotations

from behavior_tree import Node
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.quality import Quality
from regraft.bus_schema.model.adaptation import MAX_CONTEXT_SIZE, plain_size
from regraft.services.bt_executor.leaves.context import LeafContext

ROOM_FOR_THE_REST = 2_000


def decision_context(context: LeafContext, node: Node, rule: str) -> dict[str, PlainValue]:
    """Return the qualities as they are, the node that decides, and the rule that won, if there is one.

    Requirements for which there is no room are left out, the last ones of the tree first.
    """
    told: dict[str, PlainValue] = {"node": node.path[:ROOM_FOR_THE_REST]}
    if rule:
        told["rule"] = rule[:ROOM_FOR_THE_REST]
    qualities: dict[str, PlainValue] = {}
    size = plain_size(told, MAX_CONTEXT_SIZE)
    for quality in context.qualities.current():
        plain = _plain(quality)
        size += plain_size([quality.requirement, plain], MAX_CONTEXT_SIZE)
        if size > MAX_CONTEXT_SIZE - ROOM_FOR_THE_REST:
            break
        if quality.active:
            qualities[quality.requirement] = plain
    return {**told, "qualities": qualities} if qualities else told


def _plain(quality: Quality) -> dict[str, PlainValue]:
    told: dict[str, PlainValue] = {
        "metric": quality.metric,
        "satisfied": quality.satisfied,
        "degree": quality.degree,
        "status": quality.status,
    }
    return {name: value for name, value in told.items() if value not in (None, "")}
