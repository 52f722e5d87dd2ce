"""The record of FROG's search, every simulated second, with the judge's verdict at its end."""

from __future__ import annotations

from typing import Final

from regraft import Future, Input, Parameter
from regraft.bus_schema.messages.mission import MissionState, MissionStatus
from regraft.bus_schema.messages.power import BatteryState
from regraft.bus_schema.messages.world import GroundTruth
from regraft.evaluation.judgement import Judgement, JudgementRequest
from regraft.evaluation.rows import Cell, RowRecorder

ENDED: Final = (MissionState.SUCCEEDED, MissionState.FAILED, MissionState.HALTED)
COMES_TO_REST: Final = 2.0
"""s after a mission's end until the judge has heard of it, and the robot stands."""


class SearchRecorder(RowRecorder):
    """Writes down how FROG searches; the row with the verdict is the last.

    The verdict is asked for when the mission has ended, but not before ``judged_from``, and at ``judged_by`` at the
    latest. Its columns are empty until then.
    """

    may_end = True

    judged_from = Parameter(305.0, "when it is judged at the earliest: localization is, at 300 s", unit="s")
    judged_by = Parameter(896.0, "when it is judged at the latest", unit="s")

    mission = Input(MissionStatus, latest_only=True, required=False, description="what the robot does")
    battery = Input(BatteryState, latest_only=True, required=False)
    ground_truth = Input(GroundTruth, keep=256)

    def on_configure(self) -> None:
        """Begin without a verdict."""
        super().on_configure()
        self._ended: float | None = None
        self._asked: Future[Judgement] | None = None

    def row(self, now: float) -> dict[str, Cell]:
        """Return what is so now."""
        status, battery, truths = self.mission.latest, self.battery.latest, self.ground_truth.take()
        phase = status.blackboard.get("phase") if status else None
        return {
            "mission": status.state.value if status else None,
            "phase": phase if isinstance(phase, str) else None,
            "charge": battery.charge if battery else None,
            "x": truths[-1].pose.x if truths else None,
            "y": truths[-1].pose.y if truths else None,
            **_verdict(self._judged(now, status)),
        }

    def _judged(self, now: float, status: MissionStatus | None) -> Judgement | None:
        """Return the verdict if it is there; ask for it when it is time."""
        if self._ended is None and status is not None and status.state in ENDED:
            self._ended = status.stamp
        if self._asked is None:
            due = self.judged_by if self._ended is None else max(self.judged_from, self._ended + COMES_TO_REST)
            if now >= min(due, self.judged_by):
                self._asked = self.kit.call("judgement", JudgementRequest(), Judgement, timeout=20.0)
            return None
        if not self._asked.done:
            return None
        if self._asked.error is not None:
            raise self._asked.error
        self.is_over = True
        return self._asked.value


def _verdict(judged: Judgement | None) -> dict[str, Cell]:
    """Return the verdict's columns, empty without one."""
    if judged is None:
        return dict.fromkeys(VERDICT)
    charges = judged.charges
    return {
        "ended": judged.ended,
        "occupied_iou": judged.occupied_iou,
        "free_iou": judged.free_iou,
        "strict_occupied_iou": judged.strict_occupied_iou,
        "strict_free_iou": judged.strict_free_iou,
        "pose_error": judged.pose_error,
        "odometry_error": judged.odometry_error,
        "worst_pose_error": judged.worst_pose_error,
        "visited": len(judged.visited),
        "missed": len(judged.missed),
        "contacts": judged.contacts,
        "distance": judged.distance,
        "target_error": judged.target_error,
        "charges_exploring": charges.get("exploring", 0),
        "charges_visiting": charges.get("visiting", 0),
        "lowest_charge": judged.lowest_charge,
    }


VERDICT: Final = (
    "ended",
    "occupied_iou",
    "free_iou",
    "strict_occupied_iou",
    "strict_free_iou",
    "pose_error",
    "odometry_error",
    "worst_pose_error",
    "visited",
    "missed",
    "contacts",
    "distance",
    "target_error",
    "charges_exploring",
    "charges_visiting",
    "lowest_charge",
)
"""The columns of the verdict."""
