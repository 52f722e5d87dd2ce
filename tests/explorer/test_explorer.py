"""Promises of the explorer as a component."""

import math
from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from regraft import CallFailed, Component, Output, every
from regraft.bus_schema.messages.maps import Frontier, NextFrontier, OccupancyGrid
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.component.component import describe
from regraft.services.explorer.explorer import Explorer
from regraft.testing import Rig
from tests.services.rigs import set_parameters

from .rooms import RADIUS, Mapped, Room, odometry, room_of
from .tour import Tour


class SlowMapper(Component):
    """Maps all but the east end of the two chambers, a while after its start."""

    takes = 0.7
    map = Output(OccupancyGrid)
    cells: NDArray[np.int8]

    @every(seconds=takes)
    def tell(self) -> None:
        """Publish the map as it is now."""
        mapped = Mapped(two_chambers())
        mapped.cells[:] = self.cells
        mapped.cells[:, 110:] = -1
        self.map.publish(mapped.message(self.kit.now()))


@pytest.fixture
def rig() -> Iterator[Rig]:
    """Return an empty rig."""
    with Rig() as rig:
        yield rig


def two_chambers() -> Room:
    """Return a room of 6 m by 2 m: a chamber in the middle, and narrow ways to one in the west and one in the east."""
    return room_of(120, 40, [(30, 0, 3, 14), (30, 26, 3, 14), (72, 0, 3, 14), (72, 26, 3, 14)])


def test_the_goal_is_a_place_to_stand_that_faces_the_unknown(rig: Rig) -> None:
    tour = Tour(rig, two_chambers(), (0.0, 0.3))
    tour.mapped.cells[:, :40] = -1
    answer = tour.ask()
    assert answer.goal is not None
    pose, truth = answer.goal.pose, tour.room.ground((0.0, 0.3))
    cell = truth.grid.cell_of((pose.x, pose.y))
    assert truth.reachable[cell]
    assert truth.clearance[cell] >= RADIUS
    ahead = (pose.x + 0.8 * math.cos(pose.yaw), pose.y + 0.8 * math.sin(pose.yaw))
    assert tour.mapped.cells[truth.grid.cell_of(ahead)] < 0
    assert answer.goal.frame == "map"
    assert answer.distance >= math.dist((pose.x, pose.y), (0.0, 0.3)) - 0.1
    assert answer.length >= 0.2


def chamber_of(answer: Frontier) -> str:
    """Tell which chamber a goal looks into."""
    assert answer.goal is not None
    return "east" if answer.goal.pose.x > 0.0 else "west"


@pytest.mark.parametrize(("strategy", "chamber"), [("best", "east"), ("furthest", "west")])
def test_best_takes_the_near_one_of_two_alike_and_furthest_the_far_one(rig: Rig, strategy: str, chamber: str) -> None:
    tour = Tour(rig, two_chambers(), (0.1, 0.0), strategy=strategy)
    truth = tour.room.grid()
    tour.mapped.cells[:] = truth.cells
    tour.mapped.cells[:, :30] = -1
    tour.mapped.cells[:, 85:] = -1
    assert chamber_of(tour.ask()) == chamber


def test_an_explorer_s_parameters_are_set_before_it_is_configured(rig: Rig) -> None:
    explorer = rig.add(Explorer, "explorer", state=State.UNCONFIGURED)
    set_parameters(rig, "explorer", strategy="furthest", renewal=0.03)
    rig.transition("explorer", Transition.CONFIGURE)
    assert (explorer.strategy, explorer.renewal) == ("furthest", 0.03)
    assert rig.state("explorer") is State.INACTIVE


def test_the_weights_say_how_much_of_a_frontier_is_worth_the_way(rig: Rig) -> None:
    tour = Tour(rig, room_of(120, 40, []), (1.0, 0.0), gain_weight=1.0, distance_weight=1.0)
    tour.mapped.cells[:] = tour.room.grid().cells
    tour.mapped.cells[:, :20] = -1  # in the west, all of the room's width
    tour.mapped.cells[30:46, 110:] = -1  # in the east, a corner of it
    assert chamber_of(tour.ask()) == "east"
    rig.runtimes["explorer"].parameters.set({"distance_weight": 0.1})
    assert chamber_of(tour.ask()) == "west"


def test_a_place_that_was_not_reached_is_not_given_again_until_its_surroundings_change(rig: Rig) -> None:
    tour = Tour(rig, two_chambers(), (0.1, 0.0))
    known = tour.room.grid().cells
    tour.mapped.cells[:] = known
    tour.mapped.cells[:, 85:] = -1
    first = tour.ask()
    assert first.found
    assert not tour.ask(unreached=True).found
    assert not tour.ask().found
    tour.mapped.cells[:40, :20] = -1  # elsewhere: that is another frontier
    assert chamber_of(tour.ask()) == "west"
    assert not tour.ask(unreached=True).found
    tour.mapped.cells[:, 85:87] = known[:, 85:87]
    assert chamber_of(tour.ask()) == "east"


def test_a_frontier_that_stays_is_looked_at_from_a_few_places_and_then_left(rig: Rig) -> None:
    tour = Tour(rig, two_chambers(), (0.1, 0.0))
    tour.mapped.cells[:] = tour.room.grid().cells
    tour.mapped.cells[:, 85:] = -1
    seen_from: list[tuple[float, float]] = []
    while (answer := tour.ask()).goal is not None:
        tour.place = (answer.goal.pose.x, answer.goal.pose.y)  # and sees nothing new
        assert all(math.dist(tour.place, other) >= 0.19 for other in seen_from)
        seen_from.append(tour.place)
    assert 1 <= len(seen_from) <= 3


def test_one_who_never_goes_anywhere_is_not_sent_to_the_same_place_for_ever(rig: Rig) -> None:
    tour = Tour(rig, two_chambers(), (-0.4, 0.0))
    answers = 0
    while tour.ask().found:
        answers += 1
        assert answers < 60


def test_a_robot_that_charges_on_its_way_is_sent_to_the_same_place_again(rig: Rig) -> None:
    tour = Tour(rig, two_chambers(), (-0.4, 0.0))
    tour.mapped.cells[:] = tour.room.grid().cells
    tour.mapped.cells[:, 85:] = -1
    goals = [tour.ask().goal for _ in range(5)]
    assert goals[0] is not None
    assert goals == goals[:1] * 5


def test_specks_and_slits_of_the_unknown_are_no_frontiers(rig: Rig) -> None:
    tour = Tour(rig, room_of(80, 60, [(40, 30, 5, 4)]), (-1.0, 0.0))
    cells = tour.mapped.cells
    cells[:] = tour.room.grid().cells
    cells[:6] = cells[-6:] = -1
    cells[5, :] = cells[-6, :] = 100
    cells[20, 20] = cells[33, 48] = cells[50, 70] = cells[51, 71] = -1
    cells[6:8, 30] = -1  # behind nothing, along a wall
    cells[37:39, 47:50] = -1  # inside of the box
    assert tour.ask() == Frontier(found=False, left=0)


def test_beams_that_leak_through_a_wall_do_not_lead_outside(rig: Rig) -> None:
    tour = Tour(rig, room_of(80, 60, []), (-1.0, 0.0))
    cells = tour.mapped.cells
    cells[:] = tour.room.grid().cells
    cells[:5] = -1
    cells[5, 6:-6] = 100
    for column in (20, 41, 42):
        cells[0:6, column] = 0
    assert not tour.ask().found


def test_small_rest_is_known_by_parameter(rig: Rig) -> None:
    tour = Tour(rig, room_of(80, 60, []), (-1.0, 0.0), min_length=1.0)
    tour.mapped.cells[:] = tour.room.grid().cells
    tour.mapped.cells[30:36, -10:] = -1
    assert not tour.ask().found
    rig.runtimes["explorer"].parameters.set({"min_length": 0.2})
    assert tour.ask().found


def test_an_answer_waits_until_what_was_just_seen_is_mapped(rig: Rig) -> None:
    tour = Tour(rig, two_chambers(), (0.1, 0.0))
    tour.mapped.cells[:] = tour.room.grid().cells
    tour.mapped.cells[:, 85:] = -1
    answer = tour.ask()
    assert tour.go(answer)
    rig.advance(10.0)
    rig.publish("odometry", odometry(10.0, *tour.place))
    # The map of ten seconds ago shows the same frontier; the one that comes while it waits shows another.
    rig.add(SlowMapper).cells = tour.room.grid().cells
    asked_at = rig.clock.now() / 1e9
    following = rig.call("next_frontier", NextFrontier(), Frontier)
    assert following.goal is not None
    assert answer.goal is not None
    assert following.goal.pose.x > answer.goal.pose.x + 0.5
    assert rig.clock.now() / 1e9 <= asked_at + SlowMapper.takes + 0.2


def test_an_answer_does_not_wait_long_for_a_map_that_does_not_come(rig: Rig) -> None:
    tour = Tour(rig, room_of(40, 40, []), (0.0, 0.0), map_within=1.5)
    tour.ask()
    rig.advance(10.0)
    asked_at = rig.clock.now() / 1e9
    assert not rig.call("next_frontier", NextFrontier(), Frontier).found
    assert rig.clock.now() / 1e9 <= asked_at + 1.7


def test_without_a_map_or_a_place_on_it_the_request_is_refused_with_the_reason(rig: Rig) -> None:
    rig.add(Explorer, parameters={"ready_within": 1.0})
    with pytest.raises(CallFailed, match="no map has come"):
        rig.call("next_frontier", NextFrontier(), Frontier)
    rig.publish("map", Mapped(room_of(30, 30, [])).message(1.0))
    with pytest.raises(CallFailed, match="no odometry has come"):
        rig.call("next_frontier", NextFrontier(), Frontier)
    rig.publish("odometry", odometry(1.0, 50.0, 0.0))
    with pytest.raises(CallFailed, match="is off the map"):
        rig.call("next_frontier", NextFrontier(), Frontier)


def test_a_successor_knows_what_there_is_no_use_in_giving(rig: Rig) -> None:
    tour = Tour(rig, two_chambers(), (0.1, 0.0))
    tour.mapped.cells[:] = tour.room.grid().cells
    tour.mapped.cells[:, 85:] = -1
    assert tour.ask().found
    state = tour.explorer.snapshot()
    with Rig() as other:
        following = Tour(other, tour.room, (0.1, 0.0))
        following.mapped = tour.mapped
        following.explorer.restore(state)
        assert not following.ask(unreached=True).found


def test_it_tells_how_much_is_known_and_left(rig: Rig) -> None:
    tour = Tour(rig, two_chambers(), (0.1, 0.0))
    assert tour.explorer.evaluate() == {}
    answer = tour.ask()
    first = tour.explorer.evaluate()
    assert first["frontiers_left"] == answer.left > 0
    tour.explore()
    last = tour.explorer.evaluate()
    assert last["frontiers_left"] == 0
    assert last["known_area"] > first["known_area"]
    rig.transition("explorer", Transition.DEACTIVATE)


def test_a_large_map_may_take_longer_than_the_handlers_of_others() -> None:
    assert describe(Explorer).handler_timeout >= 2.0
