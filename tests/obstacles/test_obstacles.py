"""Promises of the obstacles component: what stands in a room is found, named, and looked at from good places."""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise, permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from regraft.bus_schema.messages.geometry import Pose
from regraft.bus_schema.messages.maps import Goals
from regraft.planar import Pose2D
from regraft.services.navigator.planning.grid import OccupancyGrid
from regraft.services.obstacles.obstacles import Obstacles
from regraft.services.obstacles.tour import short_tour, tour_length
from regraft.sim_service import survey
from regraft.sim_service.simulation import Simulation
from regraft.testing import Rig
from tests.explorer.rooms import Mapped, Room, frog_room, odometry, room_of
from tests.explorer.tour import Tour
from tests.services.rigs import set_parameters
from tests.support.worlds import frog_scene, truth_of

FROG = "regraft/stacks/frog/world.xml"
BOXES = [(20, 20, 6, 4), (60, 20, 3, 3), (40, 60, 5, 5), (66, 64, 10, 6)]


class Room4:
    """A room with four boxes on a rig, and the obstacles component that gets its map."""

    def __init__(self, rig: Rig, **parameters: object) -> None:
        self.rig, self.room = rig, room_of(90, 90, BOXES)
        self.obstacles = rig.add(Obstacles, parameters=parameters)
        self.told: list[Goals] = rig.collect("goals", Goals)
        self.mapped = Mapped(self.room)
        self.cells = self.mapped.cells
        self.cells[:] = self.room.grid().cells
        self.cells[:5], self.cells[-5:], self.cells[:, :5], self.cells[:, -5:] = -1, -1, -1, -1
        self.place = (0.0, 0.0)

    def show(self, seconds: float = 1.0) -> Goals:
        """Publish the map as it is, and return the newest goals after a while."""
        now = self.rig.clock.now() / 1e9
        self.rig.publish("odometry", odometry(now, *self.place))
        self.rig.publish("map", self.mapped.message(now))
        self.rig.advance(seconds)
        return self.told[-1]

    def named(self, goals: Goals) -> dict[str, int]:
        """Return which box each name is given to: the one that its goal faces."""
        return {
            goal.name: box_ahead(self.room, goal.pose.pose.x, goal.pose.pose.y, goal.pose.pose.yaw)
            for goal in goals.goals
        }


@pytest.fixture
def four() -> Iterator[Room4]:
    """Return the room with four boxes."""
    with Rig() as rig:
        yield Room4(rig)


def centre(room: Room, box: tuple[int, int, int, int]) -> tuple[float, float]:
    """Return the middle (m) of a box."""
    column, row, width, height = box
    return (room.x + (6 + column + width / 2) * 0.05, room.y + (6 + row + height / 2) * 0.05)


def box_ahead(room: Room, x: float, y: float, yaw: float) -> int:
    """Return which of the boxes is straight ahead; fails if another thing is, or nothing within 1.5 m."""
    for step in np.arange(0.0, 1.5, 0.025):
        here = (x + step * math.cos(yaw), y + step * math.sin(yaw))
        if room.walls[room.grid().cell_of(here)]:
            return min(range(len(BOXES)), key=lambda i: math.dist(centre(room, BOXES[i]), here))
    raise AssertionError("nothing ahead")


def test_every_box_is_an_object_and_no_wall_is(four: Room4) -> None:
    goals = four.show()
    assert sorted(four.named(goals).values()) == [0, 1, 2, 3]
    assert four.obstacles.evaluate()["objects"] == 4


def test_a_goal_leaves_room_and_looks_at_the_middle_of_its_object_from_near(four: Room4) -> None:
    truth = four.room.ground((0.0, 0.0))
    for goal in four.show().goals:
        pose = goal.pose.pose
        cell = truth.grid.cell_of((pose.x, pose.y))
        assert truth.reachable[cell]
        assert truth.clearance[cell] >= 0.30
        x, y = centre(four.room, BOXES[box_ahead(four.room, pose.x, pose.y, pose.yaw)])
        ahead = math.atan2(y - pose.y, x - pose.x)
        assert abs(math.remainder(ahead - pose.yaw, math.tau)) < 0.05
        assert 0.5 < math.hypot(x - pose.x, y - pose.y) < 1.1
        assert goal.pose.frame == "map"


def test_pieces_of_a_broken_wall_are_walls(four: Room4) -> None:
    four.cells[5, 10:90] = four.cells[-6, 10:90] = 100
    four.cells[5, 20:23] = four.cells[5, 40:46] = four.cells[5, 60] = -1
    four.cells[20:24, 5] = four.cells[30:38, 5] = -1
    four.cells[40, 0:6] = 0  # a beam that leaks through a gap
    assert sorted(four.named(four.show()).values()) == [0, 1, 2, 3]


def test_specks_are_no_objects(four: Room4) -> None:
    four.cells[30, 30] = four.cells[70, 30:32] = four.cells[50, 80] = 100
    four.cells[31:33, 80] = -1
    assert sorted(four.named(four.show()).values()) == [0, 1, 2, 3]


def test_an_outline_with_gaps_is_one_object(four: Room4) -> None:
    for column, row, width, height in BOXES:
        rows, columns = slice(6 + row, 6 + row + height), slice(6 + column, 6 + column + width)
        four.cells[rows, columns][1:-1, 1:-1] = -1
    four.cells[72:74, 72] = -1  # not seen where the light of the lidar only grazed it
    assert len(four.show().goals) == 4


def test_names_stay_when_the_map_moves_a_little_and_when_an_object_hides_for_a_while(four: Room4) -> None:
    before = four.named(four.show())
    whole = four.cells.copy()
    four.cells[:] = np.roll(whole, 1, axis=1)
    assert four.named(four.show()) == before
    four.cells[:] = whole
    column, row, width, height = BOXES[0]
    four.cells[6 + row : 6 + row + height, 6 + column : 6 + column + width] = 0
    assert len(four.show().goals) == 3
    four.cells[:] = whole
    assert four.named(four.show()) == before


def test_goals_stay_where_they_are_while_they_are_good(four: Room4) -> None:
    before = {goal.name: goal.pose for goal in four.show().goals}
    four.cells[40, 40] = -1
    four.place = (1.5, -1.5)
    assert {goal.name: goal.pose for goal in four.show().goals} == before


def test_a_goal_moves_when_something_is_put_on_it(four: Room4) -> None:
    before = {goal.name: goal.pose.pose for goal in four.show().goals}
    name, pose = next(iter(before.items()))
    row, column = four.room.grid().cell_of((pose.x, pose.y))
    four.cells[row - 2 : row + 3, column - 2 : column + 3] = 100
    after = {goal.name: goal.pose.pose for goal in four.show().goals}
    assert math.hypot(after[name].x - pose.x, after[name].y - pose.y) > 0.2


def test_goals_come_with_each_changed_map_and_else_now_and_then(four: Room4) -> None:
    four.show(1.0)
    assert len(four.told) == 1
    four.cells[40, 40] = -1
    four.show(1.0)
    assert len(four.told) == 2
    four.show(1.0)
    assert len(four.told) == 2
    four.rig.advance(10.0)
    assert len(four.told) == 4
    assert four.told[-1].goals == four.told[1].goals


def test_the_tour_from_the_robot_is_hardly_longer_than_the_shortest(four: Room4) -> None:
    for place in ((1.5, 1.0), (-1.5, -1.5), (0.0, 0.0)):
        four.cells[40, 40] = -1 - four.cells[40, 40]  # something has changed
        four.place = place
        told = [(goal.pose.pose.x, goal.pose.pose.y) for goal in four.show().goals]
        shortest = min(way_length(place, order) for order in permutations(told))
        assert way_length(place, told) <= 1.15 * shortest


def way_length(start: tuple[float, float], places: Sequence[tuple[float, float]]) -> float:
    """Return how long (m) the straight ways through some places are."""
    return sum(math.dist(here, there) for here, there in pairwise([start, *places]))


def test_a_successor_keeps_names_and_goals(four: Room4) -> None:
    before = {goal.name: goal.pose for goal in four.show().goals}
    state = four.obstacles.snapshot()
    with Rig() as rig:
        other = Room4(rig)
        other.obstacles.restore(state)
        other.place = (1.5, -1.5)
        assert {goal.name: goal.pose for goal in other.show().goals} == before


def viewing_distance(room: Room4) -> float:
    """Publish the map, and return the mean distance (m) from which objects are looked at."""
    room.show()
    return room.obstacles.evaluate()["viewing_distance"]


def test_another_standoff_holds_for_objects_that_are_known(four: Room4) -> None:
    before = viewing_distance(four)
    set_parameters(four.rig, "obstacles", standoff=1.0)
    after = viewing_distance(four)
    assert after - before == pytest.approx(1.0 - 0.65, abs=0.12)
    names = four.named(four.told[-1])
    assert names == four.named(four.told[0])


def test_a_successor_with_another_standoff_looks_from_there(four: Room4) -> None:
    before = viewing_distance(four)
    state = four.obstacles.snapshot()
    with Rig() as rig:
        other = Room4(rig, standoff=1.0)
        other.obstacles.restore(state)
        assert viewing_distance(other) - before == pytest.approx(1.0 - 0.65, abs=0.12)


def test_the_estimate_agrees_with_what_is_measured() -> None:
    for standoff in (0.5, 0.65, 0.8):
        with Rig() as rig:
            other = Room4(rig, standoff=standoff)
            other.show()
            measured = other.obstacles.evaluate()
        estimate = Obstacles.estimate({"standoff": standoff}, {"size": 0.25})
        assert measured["viewing_distance"] == pytest.approx(estimate["viewing_distance"], abs=0.12)
        assert measured["clearance"] >= estimate["clearance"]


def test_a_map_of_no_use_is_said_and_survived(four: Room4) -> None:
    four.place = (50.0, 0.0)
    four.rig.publish("odometry", odometry(0.0, *four.place))
    four.rig.publish("map", four.mapped.message(0.0))
    four.rig.advance(1.0)
    assert four.told == []
    four.place = (0.0, 0.0)
    assert len(four.show().goals) == 4


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_all_that_stands_in_frogs_room_is_found_once_it_is_explored(seed: int) -> None:
    simulation = Simulation(frog_scene(), seed)
    start = truth_of(simulation).pose
    with Rig() as rig:
        obstacles, told = rig.add(Obstacles), rig.collect("goals", Goals)
        tour = Tour(rig, frog_room(simulation), (start.x, start.y), 0.01)
        tour.explore(15, look_on_the_way=True)
        rig.advance(1.0)
        rig.publish("map", tour.mapped.message(99.0))
        rig.advance(1.0)
        assert obstacles.evaluate()["objects"] == 6
        faced = [ahead_of(tour.room.grid(), goal.pose.pose) for goal in told[-1].goals]
    assert len(faced) == 6
    for goal in survey.goals(simulation):
        truth = ahead_of(tour.room.grid(), goal.pose)
        assert min(math.dist(truth, point) for point in faced) < 0.45


def ahead_of(grid: OccupancyGrid, pose: Pose | Pose2D) -> tuple[float, float]:
    """Return where (m) something stands straight ahead of a pose."""
    x, y, yaw = pose.x, pose.y, pose.yaw
    occupied = grid.occupied
    for step in np.arange(0.0, 3.0, 0.025):
        here = (x + float(step) * math.cos(yaw), y + float(step) * math.sin(yaw))
        if occupied[grid.cell_of(here)]:
            return here
    raise AssertionError("nothing ahead")


@settings(max_examples=60, deadline=None)
@given(places=st.lists(st.tuples(st.floats(-5, 5), st.floats(-5, 5)), min_size=1, max_size=8))
def test_a_tour_visits_every_place_once_and_no_turned_part_makes_it_shorter(
    places: list[tuple[float, float]],
) -> None:
    lengths: NDArray[np.float64] = np.array([[math.dist(one, other) for other in places] for one in places])
    tour = [0, *short_tour(lengths)]
    assert sorted(tour) == list(range(len(places)))
    for first in range(1, len(tour)):
        for last in range(first + 1, len(tour)):
            turned = tour[:first] + tour[first : last + 1][::-1] + tour[last + 1 :]
            assert tour_length(turned, lengths) >= tour_length(tour, lengths) - 1e-6
