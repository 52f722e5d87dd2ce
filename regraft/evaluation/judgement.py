"""The judge's verdict on a run, and how it is asked for."""

from __future__ import annotations

from dataclasses import dataclass, field

from regraft.bus_schema.annotations import Count, Metres, Ratio, Seconds
from regraft.bus_schema.encoding.registry import message


@message("evaluation/JudgementRequest")
@dataclass(frozen=True, slots=True)
class JudgementRequest:
    """Request: judge the run up to now, or to its mission's end."""


@message("evaluation/Judgement")
@dataclass(frozen=True, slots=True)
class Judgement:
    """Reply: what became of a run; None for what is not known.

    Attributes:
        stamp: when it was judged.
        mission: the mission's state.
        ended: when the mission ended.
        contacts: how often the robot began to touch something.
        distance: how far it went.
        visited: when it first stood before each object that is to be visited.
        missed: the objects that it did not stand before.
        pose_error: how far localization was off at the time that is asked about, or now if that is to come.
        odometry_error: how far the odometry was off then.
        worst_pose_error: how far localization was ever off.
        occupied_iou: intersection over union of what the map calls occupied with what is.
        free_iou: the same of free ground; both forgive a cell.
        strict_occupied_iou: the same of what is occupied, forgiving nothing.
        strict_free_iou: the same of free ground, forgiving nothing.
        target_error: how far the mission's result is from the object that it looked for.
        charges: how often the robot was charged, by the mission's phase.
        lowest_charge: how empty the battery ever was.
    """

    stamp: Seconds
    mission: str
    ended: Seconds | None
    contacts: Count
    distance: Metres
    visited: dict[str, Seconds] = field(default_factory=dict)
    missed: tuple[str, ...] = ()
    pose_error: Metres | None = None
    odometry_error: Metres | None = None
    worst_pose_error: Metres = 0.0
    occupied_iou: Ratio | None = None
    free_iou: Ratio | None = None
    target_error: Metres | None = None
    charges: dict[str, Count] = field(default_factory=dict)
    lowest_charge: Ratio = 1.0
    strict_occupied_iou: Ratio | None = None
    strict_free_iou: Ratio | None = None
