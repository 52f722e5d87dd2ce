"""Promises of the localizer on a given map."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages import geometry, maps, sensors
from regraft.bus_schema.messages.health import Diagnostic
from regraft.bus_schema.model.lifecycle import Transition
from regraft.component.component import describe
from regraft.planar import Pose2D
from regraft.services.mapper.map_localizer import MapLocalizer
from regraft.services.mapper.mapper import Mapper
from regraft.testing import Rig
from tests.mapper.room import MOUNT, RANGE, THINGS, TICK, TICKS_PER_SCAN, WALLS, Ride, cast, circle, true_cells


def room_map(stamp: float = 0.0) -> maps.OccupancyGrid:
    cells, resolution, (x, y) = true_cells(WALLS + THINGS)
    return maps.OccupancyGrid(stamp, "map", resolution, geometry.Pose.planar(x, y, 0.0), cells)


@dataclass
class Walk:
    """A robot on its round, whose odometry is off by ``shift`` and turns by ``drift`` rad/s."""

    rig: Rig
    shift: Pose2D = field(default_factory=Pose2D)
    drift: float = 0.0
    ticks: int = 0
    place: list[sensors.Odometry] = field(default_factory=list)
    parameters: dict[str, float] = field(default_factory=dict)
    scans: bool = True

    def __post_init__(self) -> None:
        self.localizer = self.rig.add(MapLocalizer, "localizer", self.parameters)
        self.place = self.rig.collect("localization", sensors.Odometry)
        self.kept = self.rig.collect("kept_map", maps.OccupancyGrid)
        self.told: list[Diagnostic] = []
        self.rig.bus.subscribe(
            self.rig.keys.diagnostics, lambda sample: self.told.append(codec.decode(sample.payload, Diagnostic))
        )

    @property
    def error(self) -> float:
        truth, pose = circle(self.ticks * TICK), self.place[-1].pose
        return math.hypot(pose.x - truth.x, pose.y - truth.y)

    def odometry(self) -> sensors.Odometry:
        now = self.ticks * TICK
        read = self.shift.compose(Pose2D(yaw=self.drift * now)).compose(circle(now))
        pose = geometry.Pose.planar(read.x, read.y, read.yaw)
        return sensors.Odometry(now, "odom", "base_link", pose, geometry.Twist.planar(0.2, 0.25))

    def go(self, seconds: float) -> None:
        mount = geometry.Pose(geometry.Vector3(MOUNT.x, 0.0, 0.1))
        for _ in range(round(seconds / TICK)):
            self.rig.advance(TICK)
            self.ticks += 1
            self.rig.publish("odometry", self.odometry())
            if self.scans and self.ticks % TICKS_PER_SCAN == 0:
                now = self.ticks * TICK
                ranges = cast(WALLS + THINGS, circle(now).compose(MOUNT), self.ticks)
                scan = sensors.LaserScan(
                    now, "lidar", "base_link", mount, 0.0, math.tau / 360, 0.12, RANGE, ranges
                )  # fmt: skip
                self.rig.publish("scan", scan)

    def carry(self, seconds: float) -> None:
        """Take the robot to where it would have driven; its wheels do not turn."""
        before = circle(self.ticks * TICK)
        self.rig.advance(seconds)
        self.ticks += round(seconds / TICK)
        self.shift = self.shift.compose(before).compose(circle(self.ticks * TICK).inverse())

    def levels(self, subject: str) -> list[str]:
        return [told.level.value for told in self.told if told.subject == subject]


def test_the_place_is_told_with_every_odometry_also_while_that_drifts() -> None:
    with Rig() as rig:
        walk = Walk(rig, drift=0.01)
        rig.publish("map", room_map())
        walk.go(20.0)
        assert len(walk.place) == 400
        assert (walk.place[-1].frame, walk.place[-1].child_frame) == ("map", "base_link")
        assert walk.error < 0.05


def test_the_map_holds_when_its_maker_falls_silent_and_is_repeated() -> None:
    with Rig() as rig:
        walk = Walk(rig)
        rig.publish("map", room_map())
        walk.go(10.0)
        assert walk.error < 0.05
        assert 4 <= len(walk.kept) <= 6
        assert np.array_equal(walk.kept[-1].cells, room_map().cells)


def test_a_further_run_repeats_the_map_of_the_earlier_one_until_another_comes() -> None:
    with Rig() as rig:
        earlier = Walk(rig)
        rig.publish("map", room_map())
        earlier.go(4.0)
        state = earlier.localizer.snapshot()
    with Rig(start=4.0) as rig:
        walk = Walk(rig, ticks=earlier.ticks)
        walk.localizer.restore(state)
        walk.go(5.0)
        assert len(walk.kept) == 2
        assert _walls(walk.kept[-1]) == _walls(room_map())
        newer = true_cells(WALLS)[0]
        rig.publish("map", replace(room_map(9.0), cells=newer))
        walk.go(2.0)
        assert np.array_equal(walk.kept[-1].cells, newer)


def test_without_a_map_none_is_published() -> None:
    with Rig() as rig:
        walk = Walk(rig)
        walk.go(5.0)
        assert not walk.kept


def test_where_the_robot_is_to_begin_with_is_believed() -> None:
    with Rig() as rig:
        walk = Walk(rig, shift=Pose2D(3.0, -2.0, 1.0))
        rig.publish("map", room_map())
        walk.go(TICK)
        truth = circle(walk.ticks * TICK)
        rig.publish("start", replace(walk.odometry(), frame="map", pose=geometry.Pose.planar(*_parts(truth))))
        walk.go(2.0)
        assert walk.error < 0.05


def test_what_is_said_of_the_start_is_not_believed_against_scans_that_fit() -> None:
    with Rig() as rig:
        walk = Walk(rig)
        rig.publish("map", room_map())
        walk.go(2.0)
        rig.publish("start", replace(walk.odometry(), frame="map", pose=geometry.Pose.planar(1.0, 1.0, 0.0)))
        walk.go(0.5)
        assert walk.error < 0.05


def test_where_the_robot_is_to_begin_with_is_believed_again_after_a_rest() -> None:
    with Rig() as rig:
        walk = Walk(rig)
        rig.publish("map", room_map())
        walk.go(2.0)
        rig.transition("localizer", Transition.DEACTIVATE)
        walk.carry(6.0)
        rig.transition("localizer", Transition.ACTIVATE)
        walk.scans = False
        walk.go(TICK)
        assert walk.error > 0.5
        truth = circle(walk.ticks * TICK)
        rig.publish("start", replace(walk.odometry(), frame="map", pose=geometry.Pose.planar(*_parts(truth))))
        walk.go(0.5)
        assert walk.error < 0.05


def test_a_robot_of_unknown_place_is_searched_for_on_the_map() -> None:
    with Rig() as rig:
        walk = Walk(rig, shift=Pose2D(0.9, 0.7, 2.0))
        rig.publish("map", room_map())
        walk.go(12.0)
        assert walk.error < 0.05
        assert [event.kind for event in rig.events if event.kind.startswith("mapper.")] == [
            "mapper.lost",
            "mapper.found",
        ]


def test_a_map_of_other_cells_is_refused_and_the_last_one_holds() -> None:
    with Rig() as rig:
        walk = Walk(rig)
        rig.publish("map", room_map())
        walk.go(1.0)
        rig.publish("map", replace(room_map(1.0), resolution=0.1))
        walk.go(3.0)
        assert walk.levels("map") == ["error"]
        assert walk.error < 0.05


def test_it_goes_on_after_a_rest_during_which_the_robot_went_on() -> None:
    with Rig() as rig:
        walk = Walk(rig, drift=0.01)
        rig.publish("map", room_map())
        walk.go(4.0)
        rig.transition("localizer", Transition.DEACTIVATE)
        walk.go(4.0)
        rig.transition("localizer", Transition.ACTIVATE)
        walk.go(4.0)
        assert walk.error < 0.05


def test_a_mapper_s_state_is_of_use_to_it() -> None:
    with Rig() as rig:
        ride = Ride(rig, Mapper)
        ride.go(8.0)
        state = ride.remove()
        walk = Walk(rig, ticks=ride.ticks)
        walk.localizer.restore(state)
        walk.go(1.0)
        assert walk.error < 0.05


def test_equal_messages_give_equal_places_to_the_byte() -> None:
    seen = []
    for _ in range(2):
        with Rig() as rig:
            walk = Walk(rig, drift=0.02)
            rig.publish("map", room_map())
            walk.go(4.0)
            seen.append([codec.encode(message) for message in walk.place])
    assert seen[0] == seen[1]


def test_it_says_what_it_would_give_and_what_it_gives() -> None:
    expected = MapLocalizer.estimate({"resolution": 0.05}, {})
    assert expected.keys() == {"cpu", "pose_error"}
    assert expected["cpu"] < Mapper.estimate({"resolution": 0.05}, {})["cpu"]
    assert 0.0 < describe(MapLocalizer).resources.cpu < 0.1
    with Rig() as rig:
        walk = Walk(rig)
        rig.publish("map", room_map())
        walk.go(2.0)
        assert walk.localizer.evaluate()["inlier_ratio"] == pytest.approx(1.0, abs=0.1)


def _walls(message: maps.OccupancyGrid) -> set[tuple[int, int]]:
    """Return the occupied cells, by their places in cells."""
    rows, columns = np.nonzero(message.cells > 50)
    x, y = (round(origin / message.resolution) for origin in (message.origin.x, message.origin.y))
    return {(int(row) + y, int(column) + x) for row, column in zip(rows, columns, strict=True)}


def _parts(pose: Pose2D) -> tuple[float, float, float]:
    return pose.x, pose.y, pose.yaw


def test_a_pose_without_a_bound_is_published_although_no_scan_confirms_it() -> None:
    with Rig() as rig:
        walk = Walk(rig)
        rig.publish("map", room_map())
        walk.go(2.0)
        walk.scans = False
        walk.go(3.0)
        assert len(walk.place) == 100


def test_a_pose_is_published_for_a_bounded_time_after_the_last_scan_that_was_located() -> None:
    with Rig() as rig:
        walk = Walk(rig, parameters={"transform_tolerance": 0.5})
        rig.publish("map", room_map())
        walk.go(2.0)
        assert len(walk.place) == 40
        walk.scans = False
        walk.go(3.0)
        assert walk.place[-1].stamp == pytest.approx(2.5)
        assert walk.levels("transform") == ["error"]
        walk.scans = True
        walk.go(1.0)
        assert walk.place[-1].stamp == pytest.approx(6.0)
        assert walk.levels("transform") == ["error", "ok"]
        assert walk.error < 0.05


def test_scans_that_fit_nowhere_confirm_no_pose() -> None:
    with Rig() as rig:
        walk = Walk(rig, shift=Pose2D(0.9, 0.7, 2.0), parameters={"transform_tolerance": 0.4})
        rig.publish("map", room_map())
        walk.go(1.0)
        assert walk.place[-1].stamp == pytest.approx(0.4)
        walk.go(1.0)
        assert walk.place[-1].stamp == pytest.approx(2.0)
        assert walk.error < 0.05


def test_the_bound_begins_again_with_an_activation() -> None:
    with Rig() as rig:
        walk = Walk(rig, parameters={"transform_tolerance": 0.5})
        rig.publish("map", room_map())
        walk.go(2.0)
        rig.transition("localizer", Transition.DEACTIVATE)
        walk.go(2.0)
        rig.transition("localizer", Transition.ACTIVATE)
        walk.scans = False
        walk.go(2.0)
        assert walk.place[-1].stamp == pytest.approx(4.5)


def test_a_robot_that_was_carried_during_a_rest_is_located_by_the_first_scan() -> None:
    with Rig() as rig:
        walk = Walk(rig, parameters={"update_min_d": 5.0, "update_min_a": 3.0})
        rig.publish("map", room_map())
        walk.go(2.0)
        rig.transition("localizer", Transition.DEACTIVATE)
        walk.carry(0.5)
        rig.transition("localizer", Transition.ACTIVATE)
        walk.go(1.0)
        assert walk.error < 0.05
