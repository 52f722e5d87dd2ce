"""Promises of every mapper, whichever way it corrects the odometry."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml

from regraft import CallFailed
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.maps import LoadMap, MapFile, OccupancyGrid, SaveMap
from regraft.component.component import describe
from regraft.evaluation.map_quality import MapQuality, map_quality
from regraft.planar import Pose2D
from regraft.services.mapper.component import MappingComponent
from regraft.testing import Rig
from tests.services.rigs import set_parameters

from .room import MAPPERS, THINGS, TICK, WALLS, Ride, circle, true_cells

pytestmark = pytest.mark.slow


@pytest.fixture(params=MAPPERS, ids=lambda cls: cls.__name__)
def mapper(request: pytest.FixtureRequest) -> type[MappingComponent]:
    """Return each mapper class in turn."""
    cls: type[MappingComponent] = request.param
    return cls


@pytest.fixture
def ride(mapper: type[MappingComponent]) -> Iterator[Ride]:
    """Return a robot with a mapper, about to start."""
    with Rig() as rig:
        yield Ride(rig, mapper)


def quality(message: OccupancyGrid) -> MapQuality:
    origin = (message.origin.x, message.origin.y)
    return map_quality(message.cells, message.resolution, origin, *true_cells(WALLS + THINGS), start=(0.5, 0.0))


def occupied(message: OccupancyGrid, x: float, y: float) -> int:
    row = math.floor((y - message.origin.y) / message.resolution)
    column = math.floor((x - message.origin.x) / message.resolution)
    return int(message.cells[row, column])


def test_the_map_shows_the_walls_and_the_free_ground(ride: Ride) -> None:
    ride.go(12.0)
    found = quality(ride.maps[-1])
    assert found.iou >= 0.9, found
    assert ride.maps[-1].frame == "map"


def test_every_odometry_is_answered_with_the_place_in_the_map(ride: Ride) -> None:
    ride.go(3.0)
    assert len(ride.localized) == 60
    assert [message.stamp for message in ride.localized] == pytest.approx([TICK * n for n in range(1, 61)])
    last = ride.localized[-1]
    assert (last.frame, last.child_frame) == ("map", "base_link")
    assert (last.twist.forward, last.twist.turn) == (0.2, 0.25)
    assert ride.error < 0.03


def test_the_map_comes_about_once_a_second_while_it_changes_and_now_and_then_afterwards(ride: Ride) -> None:
    ride.go(6.0)
    assert 5 <= len(ride.maps) <= 7
    ride.speaks = {"odometry"}
    ride.go(2.0)
    ride.maps.clear()
    ride.go(9.0)
    assert 2 <= len(ride.maps) <= 4


def test_a_scan_that_comes_before_its_odometry_is_written_from_where_the_robot_was(ride: Ride) -> None:
    ride.go(1.0)
    ride.speaks = set()
    for _ in range(10):
        ride.go(4 * TICK)
        pose = circle(ride.now)
        ride.tell_scan(pose)
        ride.tell_odometry(pose)
    ride.go(1.0)
    assert occupied(ride.maps[-1], 2.02, 0.0) > 65
    assert ride.error < 0.4
    assert not ride.levels("localization")


def test_what_moved_away_leaves_no_trace(ride: Ride) -> None:
    ride.boxes = [*WALLS, *THINGS, (1.2, 0.4, 1.5, 0.7)]
    ride.go(4.0)
    assert occupied(ride.maps[-1], 1.22, 0.55) > 65
    ride.boxes = WALLS + THINGS
    ride.go(10.0)
    assert occupied(ride.maps[-1], 1.22, 0.55) < 25
    assert quality(ride.maps[-1]).iou >= 0.9


def test_a_jump_of_the_odometry_is_told_and_does_not_move_the_robot(ride: Ride) -> None:
    ride.go(4.0)
    ride.odometry = lambda pose, now: Pose2D(5.0, -3.0, 1.0).compose(pose)
    ride.go(4.0)
    assert ride.levels("odometry") == ["warning"]
    assert any(event.kind == "mapper.odometry_jump" for event in ride.rig.events)
    assert ride.error < 0.1
    assert quality(ride.maps[-1]).occupied_iou > 0.8


@pytest.mark.parametrize("sensor", ["odometry", "scan"])
def test_a_silent_sensor_is_told_once_and_when_it_is_back(ride: Ride, sensor: str) -> None:
    ride.go(2.0)
    ride.speaks = {"odometry", "scan"} - {sensor}
    ride.go(4.0)
    assert ride.levels(sensor) == ["error"]
    ride.speaks = {"odometry", "scan"}
    ride.go(4.0)
    assert ride.levels(sensor) == ["error", "ok"]
    assert ride.error < 0.05


def test_a_lidar_that_sees_nothing_erases_nothing(ride: Ride) -> None:
    ride.go(8.0)
    before = quality(ride.maps[-1]).occupied_iou
    ride.spoil = lambda ranges: np.full_like(ranges, math.inf)
    ride.go(4.0)
    mostly_blind = np.arange(360) % 12 > 0
    ride.spoil = lambda ranges: np.where(mostly_blind, np.float32(math.inf), ranges)
    ride.go(6.0)
    assert quality(ride.maps[-1]).occupied_iou >= before - 0.02


def test_a_scan_that_repeats_itself_is_told_and_not_believed(ride: Ride) -> None:
    ride.go(4.0)
    frozen: list[np.ndarray] = []

    def freeze(ranges: np.ndarray) -> np.ndarray:
        frozen.append(ranges)
        return frozen[0]

    ride.spoil = freeze
    ride.go(4.0)
    assert ride.levels("scan") == ["error"]
    assert ride.error < 0.05
    ride.spoil = lambda ranges: ranges
    ride.go(1.0)
    assert ride.levels("scan") == ["error", "ok"]


def test_equal_messages_give_equal_maps_to_the_byte(mapper: type[MappingComponent]) -> None:
    seen = []
    for _ in range(2):
        with Rig() as rig:
            ride = Ride(rig, mapper)
            ride.go(4.0)
            seen.append([codec.encode(message) for message in (*ride.maps, *ride.localized)])
    assert seen[0] == seen[1]


@pytest.mark.parametrize("successor", MAPPERS, ids=lambda cls: cls.__name__)
def test_any_mapper_goes_on_from_the_state_of_another(ride: Ride, successor: type[MappingComponent]) -> None:
    ride.odometry = lambda pose, now: Pose2D(0.3 if now > 2.0 else 0.0, 0.0, 0.0).compose(pose)
    ride.go(6.0)
    known = ride.maps[-1]
    state = ride.remove()
    follower = Ride(ride.rig, successor, ticks=ride.ticks, odometry=ride.odometry)
    follower.mapper.restore(state)
    follower.go(1.0)
    assert follower.error < 0.1
    after = follower.maps[0]
    assert after.cells.shape == known.cells.shape
    assert np.mean((after.cells >= 65) != (known.cells >= 65)) < 0.005


def test_a_state_with_a_larger_map_than_allowed_is_refused_and_changes_nothing(ride: Ride) -> None:
    ride.go(2.0)
    state = ride.remove()
    follower = Ride(ride.rig, ride.cls, {"size": 2.0, "largest": 6.0}, ticks=ride.ticks)
    follower.go(0.2)
    before = follower.mapper.snapshot()
    with pytest.raises(ValueError, match="must be at most 6 m"):
        follower.mapper.restore(state)
    assert follower.mapper.snapshot() == before
    follower.go(1.0)
    assert max(follower.maps[-1].cells.shape) <= 120


def test_a_map_as_large_as_allowed_is_continued_also_where_its_side_is_no_whole_number_of_cells(ride: Ride) -> None:
    sides: dict[str, object] = {"size": 2.02, "largest": 2.02}
    ride.remove()
    first = Ride(ride.rig, ride.cls, sides)
    first.go(2.0)
    state = first.remove()
    follower = Ride(ride.rig, ride.cls, sides, ticks=first.ticks)
    follower.mapper.restore(state)
    follower.go(1.0)
    assert follower.maps[-1].cells.shape == first.maps[-1].cells.shape


def test_a_state_is_compact(ride: Ride) -> None:
    ride.go(12.0)
    grid = ride.mapper.snapshot()["grid"]
    assert sum(len(part) for part in grid.values() if isinstance(part, bytes)) < 30_000


def test_a_saved_map_is_one_of_ros_and_is_read_back(ride: Ride, tmp_path: Path) -> None:
    ride.go(8.0)
    saved = ride.rig.call("save_map", SaveMap(str(tmp_path / "room")), MapFile)
    assert saved.file == str(tmp_path / "room.yaml")
    facts = yaml.safe_load((tmp_path / "room.yaml").read_text())
    assert facts["image"] == "room.png"
    assert facts["origin"] == pytest.approx([ride.maps[-1].origin.x, ride.maps[-1].origin.y, 0.0])
    shades = cv2.imread(str(tmp_path / "room.png"), cv2.IMREAD_UNCHANGED)
    assert shades is not None
    assert set(np.unique(shades).tolist()) == {0, 205, 254}
    loaded = ride.rig.call("load_map", LoadMap(saved.file), MapFile)
    assert loaded.known_area == pytest.approx(saved.known_area, rel=0.02)
    ride.go(6.0)
    assert quality(ride.maps[-1]).iou >= 0.9
    assert ride.error < 0.05


def test_files_are_looked_for_in_the_folder(mapper: type[MappingComponent], tmp_path: Path) -> None:
    with Rig() as rig:
        ride = Ride(rig, mapper, {"folder": str(tmp_path)})
        ride.go(1.0)
        assert rig.call("save_map", SaveMap("kept/room"), MapFile).file == str(tmp_path / "kept" / "room.yaml")


BAD_FILES = {
    "no map": (None, "No such file"),
    "no yaml": ("a: [", "is no YAML file"),
    "a list": ("- 1", "must hold the keys"),
    "no resolution": ("image: a.png\norigin: [0, 0, 0]", "'resolution' is missing"),
    "a word": ("image: a.png\nresolution: fine\norigin: [0, 0, 0]", "must be a number"),
    "nothing": ("image: a.png\nresolution: 0\norigin: [0, 0, 0]", "must be greater than 0"),
    "a flat origin": ("image: a.png\nresolution: 0.05\norigin: [0, 0]", r"must be \[x, y, yaw\]"),
    "a turned origin": ("image: a.png\nresolution: 0.05\norigin: [0, 0, 1]", "must not be turned"),
    "no picture": ("image: b.png\nresolution: 0.05\norigin: [0, 0, 0]", "cannot be read"),
    "a broken picture": ("image: a.png\nresolution: 0.05\norigin: [0, 0, 0]", "no picture"),
    "other cells": ("image: good.png\nresolution: 0.1\norigin: [0, 0, 0]", "must be 0.05 m"),
    "too large": ("image: large.png\nresolution: 0.05\norigin: [0, 0, 0]", "must be at most 40 m"),
    "a strange mode": ("image: good.png\nmode: odd\nresolution: 0.05\norigin: [0, 0, 0]", "must be one of"),
    "crossed": ("image: good.png\nresolution: 0.05\norigin: [0, 0, 0]\nfree_thresh: 0.9", "free_thresh < occupied"),
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_a_bad_map_file_is_refused_and_changes_nothing(ride: Ride, tmp_path: Path, name: str) -> None:
    text, why = BAD_FILES[name]
    (tmp_path / "a.png").write_bytes(b"no picture")
    cv2.imwrite(str(tmp_path / "good.png"), np.full((4, 4), 254, np.uint8))
    cv2.imwrite(str(tmp_path / "large.png"), np.full((1, 900), 254, np.uint8))
    if text is not None:
        (tmp_path / "map.yaml").write_text(text)
    ride.go(0.2)
    before = ride.mapper.snapshot()
    with pytest.raises(CallFailed, match=why):
        ride.rig.call("load_map", LoadMap(str(tmp_path / "map.yaml")), MapFile)
    assert ride.mapper.snapshot()["grid"] == before["grid"]


@pytest.mark.parametrize("name", ["", "map.png", "/proc/no/such"])
def test_a_map_that_cannot_be_written_is_refused(ride: Ride, name: str) -> None:
    ride.go(0.5)
    with pytest.raises(CallFailed, match=r"name|written"):
        ride.rig.call("save_map", SaveMap(name), MapFile)


def test_there_is_no_map_to_save_before_the_first_odometry(ride: Ride, tmp_path: Path) -> None:
    with pytest.raises(CallFailed, match="no odometry"):
        ride.rig.call("save_map", SaveMap(str(tmp_path / "map")), MapFile)


def test_a_map_that_would_be_too_large_is_told(mapper: type[MappingComponent]) -> None:
    with Rig() as rig:
        ride = Ride(rig, mapper, {"size": 2.0, "largest": 2.0})
        ride.go(3.0)
        assert ride.levels("map") == ["warning"]
        assert ride.maps[-1].cells.shape == (40, 40)


def test_a_map_that_is_not_updated_stays_and_still_says_where_the_robot_is(ride: Ride) -> None:
    ride.go(8.0)
    set_parameters(ride.rig, "mapper", update_map=False)
    ride.go(0.2)
    before = ride.mapper.snapshot()["grid"]
    ride.boxes = [*WALLS, *THINGS, (1.2, 0.4, 1.5, 0.7)]
    ride.go(3.0)
    assert ride.mapper.snapshot()["grid"] == before
    assert ride.error < 0.03
    set_parameters(ride.rig, "mapper", update_map=True)
    ride.go(2.0)
    assert ride.mapper.snapshot()["grid"] != before


def test_scans_of_long_ago_are_told(ride: Ride) -> None:
    ride.go(4.0)
    ride.speaks = {"odometry"}
    ride.ticks -= 60
    ride.tell_scan(circle(ride.now))
    ride.ticks += 60
    ride.go(0.5)
    assert ride.levels("scan") == ["error"]


def test_all_mappers_have_the_same_ports_services_and_state(mapper: type[MappingComponent]) -> None:
    described, first = describe(mapper), describe(MAPPERS[0])
    assert described.ports == first.ports
    assert [offered.name for offered in described.services] == ["save_map", "load_map"]
    assert described.state_version == first.state_version
    assert 0.0 < described.resources.cpu < 0.1


def test_it_says_what_it_would_give_and_what_it_gives(ride: Ride) -> None:
    expected = ride.cls.estimate({"resolution": 0.05}, {"travel_noise": 0.01})
    assert expected.keys() == {"cpu", "pose_error", "map_quality"}
    assert ride.mapper.evaluate()["known_area"] == 0.0
    ride.go(4.0)
    assert ride.mapper.evaluate()["known_area"] > 5.0
