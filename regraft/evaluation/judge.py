"""Judges a run against what really is."""

from __future__ import annotations

import math
from collections import deque

from regraft import Component, Input, Parameter, every, service
from regraft.bus_schema.messages.geometry import Pose
from regraft.bus_schema.messages.maps import Goals, OccupancyGrid
from regraft.bus_schema.messages.mission import MissionState, MissionStatus
from regraft.bus_schema.messages.power import BatteryState, ChargerState
from regraft.bus_schema.messages.sensors import Odometry
from regraft.bus_schema.messages.world import GroundTruth
from regraft.bus_schema.model.description import Resources
from regraft.evaluation.judgement import Judgement, JudgementRequest
from regraft.evaluation.map_quality import MapQuality, map_quality
from regraft.evaluation.recorder import STANDING
from regraft.evaluation.true_objects import TrueObject, true_objects

TRUTHS_KEPT = 200
"""Poses that others' messages of the same moment are compared with."""
PLUGGED_IN = 2.0
"""s on the charger that make a visit."""
AT_REST_TIMEOUT = 1.0
"""s after a mission's end in which the robot comes to rest where the mission left it."""
ENDED = (MissionState.SUCCEEDED, MissionState.FAILED, MissionState.HALTED)


class Judge(Component):
    """Reports how good a run was: the map, the localization, the visits, the contacts, the result, the battery.

    It wakes once a second and disturbs nobody. Everything is counted until the mission has ended and the robot has come
    to rest: it may still brake when its last drive is asked to have arrived. It knows the mission by its status alone:
    the phase is what the blackboard calls so, the result the place at ``result``.
    """

    resources = Resources(cpu=0.03, memory=25.0)
    handler_timeout = 2.0

    pose_error_at = Parameter(300.0, "when the localization is to be judged", minimum=0.0, unit="s")
    target = Parameter("hydrant", "the object that the mission is to locate, of those to be visited")
    result = Parameter("hydrant", "where the blackboard has its place: RESULT_x and RESULT_y")

    ground_truth = Input(GroundTruth, keep=4096, description="where the robot really is")
    true_map = Input(OccupancyGrid, latest_only=True, description="what really stands in the room")
    true_goals = Input(Goals, latest_only=True, description="from where the objects to be visited can be seen")
    odometry = Input(Odometry, keep=4096, description="where the robot is by the wheels")
    localization = Input(Odometry, keep=4096, required=False, description="where the robot thinks that it is")
    localization_given = Input(Odometry, keep=4096, required=False, description="the same, when it no longer maps")
    map = Input(OccupancyGrid, latest_only=True, required=False, description="the robot's map")
    charger = Input(ChargerState, keep=4096, required=False)
    battery = Input(BatteryState, keep=4096, required=False)
    mission = Input(MissionStatus, latest_only=True, required=False)

    def on_configure(self) -> None:
        """Begin without a judgement."""
        self._truths: deque[tuple[int, Pose]] = deque(maxlen=TRUTHS_KEPT)
        self._start: Pose | None = None
        self._last: GroundTruth | None = None
        self._distance = 0.0
        self._visited: dict[str, float] = {}
        self._objects: tuple[TrueObject, ...] = ()
        self._pose_error: float | None = None
        self._odometry_error: float | None = None
        self._worst = 0.0
        self._charges: dict[str, int] = {}
        self._plugged_at: float | None = None
        self._is_counted = False
        self._lowest = 1.0
        self._ended: float | None = None

    @every(hz=1.0)
    def absorb(self) -> None:
        """Take in what has come since the last time."""
        status = self.mission.latest
        if self._ended is None and status is not None and status.state in ENDED:
            self._ended = status.stamp
        if not self._objects and self.true_map.latest and self.true_goals.latest:
            self._objects = true_objects(self.true_map.latest, self.true_goals.latest)
        for truth in self.ground_truth.take():
            self._truths.append((_milliseconds(truth.stamp), truth.pose))
            if self._ended is None or truth.stamp <= self._ended + AT_REST_TIMEOUT:
                self._follow(truth)
        self._compare()
        self._note_power(str(status.blackboard.get("phase") or "") if status else "")

    def _follow(self, truth: GroundTruth) -> None:
        if self._start is None:
            self._start = truth.pose
        if self._last is not None:
            self._distance += math.dist(_place(self._last.pose), _place(truth.pose))
        self._last = truth
        if abs(truth.twist.forward) < STANDING and abs(truth.twist.turn) < STANDING:
            for each in self._objects:
                if each.name not in self._visited and each.is_faced_from(truth.pose):
                    self._visited[each.name] = truth.stamp

    def _compare(self) -> None:
        """Compare poses with the true ones of their moments."""
        truths = dict(self._truths)
        poses = {name: self.kit.inputs[name].take() for name in ("odometry", "localization", "localization_given")}
        for message in poses["odometry"]:
            truth = truths.get(_milliseconds(message.stamp))
            if truth is not None and message.stamp <= self.pose_error_at:
                self._odometry_error = math.dist(_place(message.pose), _place(truth))
        # While both are published, the robot uses the mapper's.
        for message in poses["localization"] or poses["localization_given"]:
            truth = truths.get(_milliseconds(message.stamp))
            if truth is not None:
                self._note_pose_error(message.stamp, math.dist(_place(message.pose), _place(truth)))

    def _note_pose_error(self, stamp: float, error: float) -> None:
        if stamp <= self.pose_error_at:
            self._pose_error = error
        if self._ended is None:
            self._worst = max(self._worst, error)

    def _note_power(self, phase: str) -> None:
        """Count stays on the charger, and note how empty the battery is."""
        for charger in self.charger.take():
            if not charger.connected:
                self._plugged_at = None
            elif self._plugged_at is None:
                self._plugged_at, self._is_counted = charger.stamp, False
            elif charger.stamp - self._plugged_at >= PLUGGED_IN and not self._is_counted and self._ended is None:
                self._is_counted = True
                self._charges[phase] = self._charges.get(phase, 0) + 1
        for battery in self.battery.take():
            if self._ended is None:
                self._lowest = min(self._lowest, battery.charge)

    @service("judgement")
    def judgement(self, request: JudgementRequest) -> Judgement:
        """Judge the run up to now, or to its mission's end."""
        self.absorb()
        status, quality = self.mission.latest, self._map_quality()
        return Judgement(
            self.kit.now(),
            status.state.value if status else "",
            self._ended,
            self._last.contacts if self._last else 0,
            self._distance,
            dict(self._visited),
            tuple(each.name for each in self._objects if each.name not in self._visited),
            self._pose_error,
            self._odometry_error,
            self._worst,
            quality.occupied_iou if quality else None,
            quality.free_iou if quality else None,
            self._target_error(),
            dict(self._charges),
            self._lowest,
            quality.strict_occupied_iou if quality else None,
            quality.strict_free_iou if quality else None,
        )

    def _map_quality(self) -> MapQuality | None:
        grid, truth, start = self.map.latest, self.true_map.latest, self._start
        if grid is None or truth is None or start is None:
            return None
        return map_quality(
            grid.cells,
            grid.resolution,
            (grid.origin.x, grid.origin.y),
            truth.cells,
            truth.resolution,
            (truth.origin.x, truth.origin.y),
            start=_place(start),
        )

    def _target_error(self) -> float | None:
        """Return how far (m) the mission's result is from the object that it is to locate, None without a result."""
        board = self.mission.latest.blackboard if self.mission.latest else {}
        x, y = board.get(f"{self.result}_x"), board.get(f"{self.result}_y")
        target = next((each for each in self._objects if each.name == self.target), None)
        if target is None or not isinstance(x, float) or not isinstance(y, float):
            return None
        return math.dist((x, y), target.middle)


def _place(pose: Pose) -> tuple[float, float]:
    return pose.x, pose.y


def _milliseconds(seconds: float) -> int:
    return round(seconds * 1e3)
