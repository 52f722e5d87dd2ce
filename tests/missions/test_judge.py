"""What the judge of a run says."""

from __future__ import annotations

import math

import numpy as np
import pytest

from regraft.bus_schema.messages.geometry import FramedPose, Pose, Twist
from regraft.bus_schema.messages.maps import Goals, NamedGoal, OccupancyGrid
from regraft.bus_schema.messages.mission import MissionState, MissionStatus
from regraft.bus_schema.messages.power import BatteryState, ChargerState
from regraft.bus_schema.messages.sensors import Odometry
from regraft.bus_schema.messages.world import GroundTruth
from regraft.evaluation.judge import Judge
from regraft.evaluation.judgement import Judgement, JudgementRequest
from regraft.evaluation.runs.search_run import SearchRun
from regraft.evaluation.search_campaign import is_kept, report, seeds_of
from regraft.evaluation.true_objects import true_objects
from regraft.testing import Rig

STILL = Twist()


def room() -> OccupancyGrid:
    """Return a room of 4 m with walls and a square of 0.4 m around (1, 0), the map's origin in the middle."""
    cells = np.zeros((80, 80), np.int8)
    cells[[0, -1], :] = cells[:, [0, -1]] = 100
    cells[36:44, 56:64] = 100
    return OccupancyGrid(0.0, "map", 0.05, Pose.planar(-2.0, -2.0, 0.0), cells)


def viewing_goals() -> Goals:
    return Goals(0.0, (NamedGoal("hydrant", FramedPose("map", Pose.planar(0.0, 0.0, 0.0))),))


class Run:
    """A run that the judge follows."""

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self.ticks = 0
        rig.add(Judge, parameters={"pose_error_at": 3.0})
        rig.publish("true_map", room())
        rig.publish("true_goals", viewing_goals())

    def at(self, x: float, y: float, yaw: float, seconds: float = 1.0, off: float = 0.0, contacts: int = 0) -> None:
        """Let the robot stand somewhere, with a localization that is off by so much (m), and odometry twice."""
        for _ in range(round(seconds * 20)):
            self.rig.advance(0.05)
            self.ticks += 1
            now, pose = self.ticks * 0.05, Pose.planar(x, y, yaw)
            self.rig.publish("ground_truth", GroundTruth(now, self.ticks, pose, STILL, (), contacts))
            for topic, error in (("odometry", 2 * off), ("localization", off)):
                wrong = Pose.planar(x + error, y, yaw)
                self.rig.publish(topic, Odometry(now, "map", "base_link", wrong, STILL))

    def mission(self, state: MissionState, **board: object) -> None:
        self.rig.publish("mission", MissionStatus(self.ticks * 0.05, state, "Search", 1, blackboard=dict(board)))

    def judged(self) -> Judgement:
        return self.rig.call("judgement", JudgementRequest(), Judgement)


def test_objects_are_what_stands_ahead_of_the_viewing_goals() -> None:
    (found,) = true_objects(room(), viewing_goals())
    assert found.name == "hydrant"
    assert found.middle == pytest.approx((1.0, 0.0))
    assert found.is_faced_from(Pose.planar(0.2, 0.0, 0.1))
    assert not found.is_faced_from(Pose.planar(0.2, 0.0, 0.5))
    assert not found.is_faced_from(Pose.planar(-1.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="nothing stands ahead"):
        true_objects(room(), Goals(0.0, (NamedGoal("air", FramedPose("map", Pose.planar(9.0, 9.0, 0.0))),)))


def test_an_object_is_visited_by_standing_before_it_and_facing_it() -> None:
    with Rig() as rig:
        run = Run(rig)
        run.at(-1.0, 0.0, 0.0, 2.0)
        assert run.judged().missed == ("hydrant",)
        run.at(1.0, 0.9, -math.pi / 2, 2.0)
        assert run.judged().visited.keys() == {"hydrant"}


def test_pose_errors_are_those_of_the_moment_that_is_asked_about_and_the_worst() -> None:
    with Rig() as rig:
        run = Run(rig)
        run.at(0.0, 0.0, 0.0, 2.0, off=0.02)
        run.at(0.0, 0.0, 0.0, 1.0, off=0.05)
        run.at(0.0, 0.0, 0.0, 3.0, off=0.3)
        judged = run.judged()
        assert judged.pose_error == pytest.approx(0.05, abs=1e-6)
        assert judged.odometry_error == pytest.approx(0.10, abs=1e-6)
        assert judged.worst_pose_error == pytest.approx(0.3, abs=1e-6)


def test_the_result_is_compared_with_where_the_object_is() -> None:
    with Rig() as rig:
        run = Run(rig)
        run.at(0.0, 0.0, 0.0)
        assert run.judged().target_error is None
        run.mission(MissionState.SUCCEEDED, hydrant_x=1.1, hydrant_y=0.0)
        run.at(0.0, 0.0, 0.0)
        judged = run.judged()
        assert judged.target_error == pytest.approx(0.1, abs=1e-6)
        assert judged.mission == "succeeded"
        assert judged.ended == pytest.approx(1.0)


def test_stays_on_the_charger_are_counted_by_the_mission_s_phase_and_not_after_it() -> None:
    with Rig() as rig:
        run = Run(rig)
        for phase, state in (("exploring", MissionState.RUNNING), ("visiting", MissionState.SUCCEEDED)):
            run.mission(state, phase=phase)
            run.at(0.0, 0.0, 0.0, 2.0)
            for connected in (False, *(True,) * 8, False):
                run.at(0.0, 0.0, 0.0, 0.5)
                rig.publish("charger", ChargerState(run.ticks * 0.05, connected, 20.0 * connected))
                rig.publish(
                    "battery", BatteryState(run.ticks * 0.05, 1000.0, 2000.0, 0.5 * (phase == "exploring"), 7.0)
                )
            run.at(0.0, 0.0, 0.0, 2.0)
        judged = run.judged()
        assert judged.charges == {"exploring": 1}
        assert judged.lowest_charge == 0.5


def test_the_map_is_compared_with_what_is() -> None:
    with Rig() as rig:
        run = Run(rig)
        run.at(0.0, 0.0, 0.0)
        assert run.judged().free_iou is None
        rig.publish("map", room())
        assert (run.judged().occupied_iou, run.judged().free_iou) == (1.0, 1.0)


def _run(seed: int, **judged: object) -> SearchRun:
    good: dict[str, object] = {
        "visited": {"hydrant": 1.0}, "pose_error": 0.02, "odometry_error": 0.5, "occupied_iou": 0.95, "free_iou": 0.99,
        "target_error": 0.05, "charges": {"exploring": 2}, "lowest_charge": 0.6,
    }  # fmt: skip
    judgement = Judgement(300.0, "succeeded", 250.0, 0, 30.0, **{**good, **judged})  # type: ignore[arg-type]
    summary = {"digest": f"{seed:x}" * 64, "ticks": 6000}
    return SearchRun(seed, judgement, (), {"reproducible": True, "real_time_factor": 12.0, **summary})


def test_promises_hold_when_nine_of_ten_rooms_keep_them() -> None:
    runs = [_run(seed) for seed in range(9)]
    assert is_kept([*runs, _run(9, pose_error=0.2)], {})
    assert not is_kept([*runs, _run(9, lowest_charge=0.0)], {})
    assert not is_kept([_run(9, missed=("hydrant",)), *runs[:8], _run(8, target_error=None)], {9: "did not come up"})


def test_the_table_has_a_line_for_every_seed_and_every_promise() -> None:
    said = report([_run(1), _run(2, target_error=None)], {3: "did not come up"})
    assert "| 1 | succeeded | 250 | 0.950 | 0.990 | 0.020 | 0.500" in said
    assert "| 12.0 | `111111111111`, 6000 |" in said
    assert "| 3 | did not come up |" in said
    assert len({line.count("|") for line in said.splitlines() if line.startswith("|")}) == 1
    assert "hydrant located within 0.3 m: 1 of 3 (BROKEN, needs 3)" in said


def test_seeds_are_read() -> None:
    assert seeds_of("1-3,8") == [1, 2, 3, 8]
