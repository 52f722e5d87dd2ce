"""Promises of exploring, from the first look to the end; every strategy keeps them."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from regraft.services.explorer.explorer import Explorer
from regraft.services.explorer.strategies import STRATEGIES
from regraft.sim_service.simulation import Simulation
from regraft.testing import Rig
from tests.support.worlds import frog_scene, truth_of

from .rooms import Room, frog_room, room_of, standing_places
from .tour import Tour

pytestmark = pytest.mark.slow

FROG = "regraft/stacks/frog/world.xml"
every_strategy = pytest.mark.parametrize("strategy", sorted(STRATEGIES))


@st.composite
def rooms(draw: st.DrawFn) -> tuple[Room, tuple[float, float]]:
    """Draw a walled room with boxes, some of them as large as walls, and a place to start."""
    columns, rows = draw(st.integers(24, 80)), draw(st.integers(24, 80))
    boxes = []
    for _ in range(draw(st.integers(0, 6))):
        width, height = draw(st.integers(2, max(3, columns // 2))), draw(st.integers(2, 12))
        boxes.append((draw(st.integers(0, columns - 3)), draw(st.integers(0, rows - 3)), width, height))
    room = room_of(columns, rows, [_within(box, columns, rows) for box in boxes])
    places = standing_places(room)
    if not places:
        room = room_of(columns, rows, [])
        places = standing_places(room)
    return room, places[draw(st.integers(0, len(places) - 1))]


def _within(box: tuple[int, int, int, int], columns: int, rows: int) -> tuple[int, int, int, int]:
    column, row, width, height = box
    return (column, row, min(width, columns - column), min(height, rows - row))


@every_strategy
@settings(max_examples=10, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(course=rooms())
def test_exploring_a_closed_room_ends_with_all_reachable_ground_known(
    strategy: str, course: tuple[Room, tuple[float, float]]
) -> None:
    room, start = course
    with Rig() as rig:
        tour = Tour(rig, room, start, strategy=strategy)
        tour.explore()
        assert tour.unseen() <= 0.03


@every_strategy
@settings(max_examples=4, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(course=rooms(), noise=st.sampled_from([0.01, 0.03]))
def test_exploring_ends_however_noisy_the_lidar_is(
    strategy: str, course: tuple[Room, tuple[float, float]], noise: float
) -> None:
    room, start = course
    with Rig() as rig:
        Tour(rig, room, start, noise, strategy=strategy).explore()


@every_strategy
def test_frogs_room_is_seen_whole_whatever_stands_where(strategy: str) -> None:
    scene = frog_scene()
    for seed in (1, 2):
        simulation = Simulation(scene, seed)
        start = truth_of(simulation).pose
        with Rig() as rig:
            tour = Tour(rig, frog_room(simulation), (start.x, start.y), 0.01, strategy=strategy)
            tour.explore(15, look_on_the_way=True)
            assert tour.unseen() == 0.0


@every_strategy
def test_the_estimate_of_the_way_is_right_within_a_half(strategy: str) -> None:
    random = np.random.default_rng(5)
    driven, estimated = 0.0, 0.0
    for _ in range(3):
        columns, rows = random.integers(60, 110, 2).tolist()
        boxes = [(*random.integers(8, (columns - 16, rows - 16)).tolist(), 6, 5) for _ in range(4)]
        room = room_of(columns, rows, boxes)
        with Rig() as rig:
            tour = Tour(rig, room, standing_places(room)[0], strategy=strategy)
            tour.explore(look_on_the_way=True)
            driven += tour.distance
        estimated += Explorer.estimate({"strategy": strategy}, {"area": columns * rows * 0.0025})["distance"]
    assert 0.5 * estimated < driven < 1.5 * estimated


@every_strategy
def test_equal_maps_give_equal_answers(strategy: str) -> None:
    room = room_of(70, 60, [(20, 20, 8, 6), (45, 30, 4, 20), (30, 45, 12, 4)])
    runs = []
    for _ in range(2):
        with Rig() as rig:
            tour = Tour(rig, room, standing_places(room)[0], 0.01, strategy=strategy)
            tour.explore()
            runs.append(tour.answers)
    assert runs[0] == runs[1]
