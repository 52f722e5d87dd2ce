"""Promises about people who walk through the world."""

import math
import re
from pathlib import Path

import msgpack
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from regraft.bus_schema.errors import BadMessage
from regraft.planar import Pose2D
from regraft.sim_service import survey
from regraft.sim_service.cameras.camera import CameraSettings
from regraft.sim_service.cameras.ray_camera import RayCamera
from regraft.sim_service.layout.placement import Placement
from regraft.sim_service.layout.scene import SceneError
from regraft.sim_service.people.walkers import COURTESY, Person, Way, Waypoint
from regraft.sim_service.simulation import Simulation, SimulationSettings
from tests.support.worlds import new_contacts, truth_of, turn_of, with_waffle

from .worlds import FROG, OUT_OF_THE_WAY, drive, frog

WITH_VISITOR = FROG.with_name("world_with_visitor.xml")


def walk(
    *places: tuple[float, float], speed: float = 0.3, name: str = "visitor", group: str = "", loop: bool = False
) -> Person:
    return Person(name, tuple(Waypoint(x, y) for x, y in places), speed, group, loop)


WALK = walk((1.5, -0.6), (-1.5, -0.6), speed=0.5)


def visited(people: tuple[Person, ...] = (WALK,), robot: Pose2D | None = None) -> Simulation:
    """Return FROG with a visitor and with the robot somewhere."""
    placement = Placement({**OUT_OF_THE_WAY, "base": robot or Pose2D(0.0, -1.8, math.pi / 2)})
    return Simulation(with_waffle(WITH_VISITOR), 1, SimulationSettings(people=people), placement)


def place_of(simulation: Simulation, person: str) -> tuple[float, float]:
    scene = simulation.scene
    joints = [scene.index("joint", f"{person}_{axis}") for axis in "xy"]
    x, y = (float(simulation.render_state().qpos[scene.model.jnt_qposadr[joint]]) for joint in joints)
    return x + 4.0, y


@pytest.mark.parametrize(
    ("waypoints", "complaint"),
    [(((1.0, 0.0),), "two or more waypoints"), (((1.0, 0.0), (1.0, 0.0)), "neighbours at different places")],
)
def test_a_walk_that_leads_nowhere_is_refused(waypoints: tuple[tuple[float, float], ...], complaint: str) -> None:
    with pytest.raises(BadMessage, match=complaint):
        walk(*waypoints)


def test_a_loop_that_ends_where_it_begins_and_a_group_of_two_words_are_refused() -> None:
    with pytest.raises(BadMessage, match="neighbours at different places, the last and the first of a loop too"):
        walk((0.0, 0.0), (1.0, 0.0), (0.0, 0.0), loop=True)
    with pytest.raises(BadMessage, match="'a crowd': must be a name without spaces"):
        walk((0.0, 0.0), (1.0, 0.0), group="a crowd")


places = st.tuples(st.integers(-20, 20), st.integers(-20, 20)).map(lambda p: (p[0] / 10, p[1] / 10))


@given(st.lists(places, min_size=2, max_size=6, unique=True), st.floats(0.0, 100.0), st.floats(0.0, 1.0), st.booleans())
def test_a_walk_never_jumps(at: list[tuple[float, float]], travelled: float, step: float, loop: bool) -> None:
    way = Way(walk(*at, loop=loop))
    one, other = way.pose(travelled), way.pose(travelled + step)
    assert math.hypot(one.x - other.x, one.y - other.y) <= step + 1e-6


def test_a_loop_leads_from_its_last_place_straight_to_its_first_and_round_again() -> None:
    way = Way(walk((0.0, 0.0), (3.0, 0.0), (3.0, 4.0), loop=True))
    assert way.length == 12.0
    for around in (0.0, 12.0, 1200.0):
        back = way.pose(around + 9.5)
        assert (back.x, back.y) == pytest.approx((1.5, 2.0))
        assert back.yaw == pytest.approx(math.atan2(-4.0, -3.0))
        assert way.pose(around + 1.0) == Pose2D(1.0, 0.0, 0.0)


def test_the_visitor_walks_to_and_fro_at_its_speed() -> None:
    simulation = visited()
    simulation.advance(2.0)
    assert place_of(simulation, "visitor") == pytest.approx((0.5, -0.6), abs=0.02)
    simulation.advance(7.0)
    assert place_of(simulation, "visitor") == pytest.approx((0.0, -0.6), abs=0.02)
    assert truth_of(simulation).pose.y == pytest.approx(-1.8, abs=0.01)


def test_lidar_and_cameras_see_the_visitor() -> None:
    simulation = visited(robot=Pose2D(0.0, -1.8, math.pi / 2))
    simulation.advance(1.0)
    pictures, ahead = [], []
    camera = RayCamera(simulation.scene, simulation.placement, CameraSettings("camera", 80, 60))
    for _ in range(2):
        ahead.append(float(turn_of(simulation).ranges[0]))
        pictures.append(camera.render(simulation.render_state()).astype(int))
        simulation.advance(2.0)
    assert ahead[1] < 1.3 < ahead[0]
    assert np.mean(np.abs(pictures[0] - pictures[1]).max(axis=2) > 30) > 0.02


def test_the_visitor_waits_for_a_robot_in_its_way_and_never_runs_into_it() -> None:
    simulation = visited(robot=Pose2D(0.0, -0.6, math.pi / 2))
    for _ in range(100):
        simulation.advance(0.1)
        x, y = place_of(simulation, "visitor")
        assert math.hypot(x, y + 0.6) > COURTESY - 0.02
    assert not new_contacts(simulation)
    drive(simulation, -0.26, 0.0, 4.0)
    passed = []
    for _ in range(50):
        simulation.advance(0.1)
        passed.append(place_of(simulation, "visitor")[0])
    assert min(passed) == pytest.approx(-1.5, abs=0.05)


def test_the_visitor_begins_away_from_the_robot() -> None:
    simulation = visited(robot=Pose2D(1.5, -0.6, 0.0))
    x, y = place_of(simulation, "visitor")
    assert math.hypot(x - 1.5, y + 0.6) >= COURTESY
    simulation.advance(1.0)
    assert not new_contacts(simulation)


def test_a_visited_run_continues_from_its_snapshot_bit_by_bit() -> None:
    original = visited()
    drive(original, 0.1, 0.2, 3.0)
    packed = msgpack.packb(original.snapshot())
    drive(original, 0.1, 0.2, 3.0)
    successor = visited()
    successor.restore(msgpack.unpackb(packed))
    drive(successor, 0.1, 0.2, 3.0)
    assert successor.digest() == original.digest()


def test_a_visitor_without_a_walk_stays_outside_and_is_not_on_the_map() -> None:
    simulation = visited(())
    simulation.advance(1.0)
    assert place_of(simulation, "visitor")[0] == pytest.approx(4.0, abs=1e-6)
    plain = Simulation(frog(), 1, placement=simulation.placement)
    np.testing.assert_array_equal(survey.ground_map(simulation).occupancy, survey.ground_map(plain).occupancy)


def test_a_walk_in_a_world_without_visitor_is_refused() -> None:
    with pytest.raises(SceneError, match="no joint named 'visitor_x'"):
        Simulation(frog(), 1, SimulationSettings(people=(WALK,)))


def test_several_people_walk_each_on_their_own_way(tmp_path: Path) -> None:
    file = tmp_path / "crowd.xml"
    second = re.search(r'<body name="visitor".*?</body>', WITH_VISITOR.read_text(), re.DOTALL)
    assert second is not None
    world = WITH_VISITOR.read_text().replace("</worldbody>", second[0].replace("visitor", "guest") + "</worldbody>")
    file.write_text(world.replace('file="world.xml"', f'file="{FROG}"'))
    people = (WALK, walk((-1.0, 1.8), (1.0, 1.8), speed=0.2, name="guest"))
    placement = Placement({**OUT_OF_THE_WAY, "base": Pose2D(0.0, -1.8, math.pi / 2)})
    simulation = Simulation(with_waffle(file), 1, SimulationSettings(people=people), placement)
    simulation.advance(2.0)
    assert place_of(simulation, "visitor") == pytest.approx((0.5, -0.6), abs=0.02)
    assert place_of(simulation, "guest") == pytest.approx((-0.6, 1.8), abs=0.02)


CROWD = (walk((1.5, -0.6), (-1.5, -0.6), speed=0.5, group="crowd"),)
OUTSIDE = (4.0, 0.0)


def test_people_of_a_group_are_outside_until_it_comes_and_after_it_goes() -> None:
    simulation = visited(CROWD)
    simulation.advance(1.0)
    assert (place_of(simulation, "visitor"), simulation.present) == (OUTSIDE, frozenset())
    simulation.set_present("crowd", present=True)
    assert simulation.present == {"crowd"}
    simulation.advance(2.0)
    assert place_of(simulation, "visitor") == pytest.approx((0.5, -0.6), abs=0.02)
    simulation.set_present("crowd", present=False)
    assert (place_of(simulation, "visitor"), simulation.present) == (OUTSIDE, frozenset())
    simulation.advance(1.0)
    assert place_of(simulation, "visitor") == OUTSIDE
    simulation.set_present("crowd", present=True)
    simulation.advance(1.0)
    assert place_of(simulation, "visitor") == pytest.approx((1.0, -0.6), abs=0.02)


@given(st.floats(-1.8, 1.8), st.floats(-1.2, 0.0))
@settings(max_examples=25)
def test_nobody_of_a_group_appears_in_a_robot(x: float, y: float) -> None:
    simulation = visited(CROWD, robot=Pose2D(x, y, 0.0))
    simulation.set_present("crowd", present=True)
    for _ in range(4):
        simulation.advance(0.05)
        there = place_of(simulation, "visitor")
        assert math.dist(there, (x, y)) > COURTESY - 0.02
    assert there != OUTSIDE
    assert not new_contacts(simulation)


def test_a_person_whose_whole_walk_is_taken_comes_when_the_robot_has_left() -> None:
    simulation = visited((walk((0.0, -0.6), (0.2, -0.6), group="crowd"),), robot=Pose2D(0.1, -0.6, -math.pi / 2))
    simulation.set_present("crowd", present=True)
    simulation.advance(1.0)
    assert place_of(simulation, "visitor") == OUTSIDE
    drive(simulation, 0.26, 0.0, 4.0)
    assert place_of(simulation, "visitor") != OUTSIDE
    assert not new_contacts(simulation)


def test_a_run_with_a_group_continues_from_its_snapshot_bit_by_bit() -> None:
    original = visited(CROWD)
    for present in (False, True):
        original.set_present("crowd", present=present)
        drive(original, 0.1, 0.2, 1.0)
        packed = msgpack.packb(original.snapshot())
        drive(original, 0.1, 0.2, 1.0)
        successor = visited(CROWD)
        successor.restore(msgpack.unpackb(packed))
        assert successor.present == ({"crowd"} if present else frozenset())
        drive(successor, 0.1, 0.2, 1.0)
        assert successor.digest() == original.digest()
