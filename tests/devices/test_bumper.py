"""Promises about bumpers."""

import math
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from regraft.sim_service.devices.bumper import Bumper
from regraft.sim_service.layout.scene import SceneError
from regraft.sim_service.simulation import Simulation

from .worlds import FLOOR, device, found, listen, robot, run, simulated

TOUCHING = 0.0545
"""m between the middles of robot and post: half a millimetre less than their radii."""


def post_at(bearing: float, distance: float) -> str:
    """Return a floor, and a post that stands in a direction."""
    x, y = distance * math.cos(bearing), distance * math.sin(bearing)
    return f'{FLOOR}<body name="post" pos="{x} {y} .1"><geom type="cylinder" size=".02 .1"/></body>'


def touching(folder: Path, bearing: float = 0.0, distance: float = TOUCHING, **parameters: Any) -> Simulation:
    """Return a robot with a bumper beside a post."""
    puck = robot(folder, "", [device(Bumper, **parameters)], moves=True)
    return simulated(folder, puck, body=post_at(bearing, distance))


def back_off(simulation: Simulation) -> None:
    """Push the robot away from a post in front of it."""
    found(simulation, Bumper).kit.data.qvel[0] = -0.5


@settings(max_examples=20, deadline=None)
@given(st.floats(-3.1, 3.1), st.integers(1, 12))
def test_a_touch_has_the_bearing_of_the_body_and_its_sector(bearing: float, sectors: int) -> None:
    with TemporaryDirectory() as folder:
        simulation = touching(Path(folder), bearing, sectors=sectors)
    run(simulation)
    touches = found(simulation, Bumper).measure().touches
    assert {touch.body for touch in touches} == {"post"}
    width = 2.0 * math.pi / sectors
    for touch in touches:
        assert math.remainder(touch.bearing - bearing, 2.0 * math.pi) == pytest.approx(0.0, abs=0.05)
        assert abs(math.remainder(touch.bearing - touch.sector * width, 2.0 * math.pi)) <= width / 2.0 + 1e-9


def test_the_floor_and_a_post_out_of_reach_are_not_felt(tmp_path: Path) -> None:
    simulation = touching(tmp_path, distance=0.06)
    run(simulation, 0.2)
    assert found(simulation, Bumper).measure().touches == ()


@pytest.mark.parametrize(("name", "felt"), [('name="pillar"', "pillar"), ("", "geom 1")])
def test_a_geom_of_the_world_that_has_no_body_is_felt_by_its_own_name(tmp_path: Path, name: str, felt: str) -> None:
    pillar = f'<geom {name} type="cylinder" size=".02 .1" pos="{TOUCHING} 0 .1"/>'
    simulation = simulated(tmp_path, robot(tmp_path, "", [device(Bumper)], moves=True), body=FLOOR + pillar)
    run(simulation)
    assert {touch.body for touch in found(simulation, Bumper).measure().touches} == {felt}
    assert [event.body for event in simulation.robot().contacts.take_events()] == [felt]


LAND = '<asset><hfield name="land" nrow="2" ncol="2" elevation="0 0 0 0" size="5 5 .1 .1"/></asset>'


@pytest.mark.parametrize(
    "floor",
    [
        FLOOR,
        f'<body name="ground">{FLOOR}</body>',
        '<geom type="hfield" hfield="land"/>',
        '<geom type="box" size="5 5 .1" pos="0 0 -.1"/>',
    ],
    ids=["plane", "plane of a body", "height field", "slab"],
)
def test_a_floor_of_any_kind_is_not_felt(tmp_path: Path, floor: str) -> None:
    puck = robot(tmp_path, "", [device(Bumper)], moves=True)
    simulation = simulated(tmp_path, puck, body=floor, extra=LAND)
    run(simulation, 0.2)
    assert len(found(simulation, Bumper).kit.data.contact.geom) > 0
    assert found(simulation, Bumper).measure().touches == ()
    assert simulation.robot().contacts.take_events() == ()


def test_a_touch_between_two_ticks_is_reported_once(tmp_path: Path) -> None:
    simulation = touching(tmp_path)
    heard = listen(simulation, "bumps")
    run(simulation)
    back_off(simulation)
    run(simulation)
    assert [[touch.body for touch in state.touches] for state in heard] == [["post"], []]


def test_a_touch_waits_for_a_slow_bumper(tmp_path: Path) -> None:
    simulation = touching(tmp_path, rate=5.0)
    heard = listen(simulation, "bumps")
    run(simulation, 0.1)
    back_off(simulation)
    run(simulation, 0.3)
    assert [len(state.touches) for state in heard] == [1, 0]
    assert [round(state.stamp, 6) for state in heard] == [0.2, 0.4]


def test_a_bumper_with_a_threshold_feels_what_presses_hard_enough(tmp_path: Path) -> None:
    for threshold, felt in ((0.01, 1), (1e6, 0)):
        simulation = touching(tmp_path, threshold=threshold)
        run(simulation)
        assert len(found(simulation, Bumper).measure().touches) == felt


def test_a_bumper_of_some_geoms_feels_with_these_alone(tmp_path: Path) -> None:
    body = (
        '<geom name="hull" type="cylinder" size=".035 .02" pos="0 0 .02"/><geom name="mast" size=".001" pos="0 0 .1"/>'
    )
    for geom, felt in (("hull", 1), ("mast", 0)):
        puck = robot(tmp_path, "", [device(Bumper, geoms=geom)], body=body, moves=True)
        simulation = simulated(tmp_path, puck, body=post_at(0.0, TOUCHING))
        run(simulation)
        assert len(found(simulation, Bumper).measure().touches) == felt


def test_robots_feel_each_other_by_their_names(tmp_path: Path) -> None:
    left = robot(tmp_path, "left", [device(Bumper)], moves=True)
    right = robot(tmp_path, "right", [device(Bumper)], (0.0695, 0.0, math.pi / 2), moves=True)
    simulation = simulated(tmp_path, left, right)
    run(simulation)
    (felt,) = found(simulation, Bumper, of="left").measure().touches
    assert (felt.body, felt.sector) == ("right/base", 0)
    (felt,) = found(simulation, Bumper, of="right").measure().touches
    assert (felt.body, felt.sector) == ("left/base", 2)


def test_a_stuck_bumper_seems_pressed_and_a_dropout_loses_touches(tmp_path: Path) -> None:
    simulation = touching(tmp_path, stuck_sector=3, dropout=1.0)
    run(simulation)
    bumper = found(simulation, Bumper)
    bumper.kit.failing = "stuck"
    assert [(touch.body, touch.sector) for touch in bumper.measure().touches] == [("", 3), ("post", 0)]
    bumper.kit.failing = "dropout"
    assert bumper.measure().touches == ()


def test_a_geom_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"no geom named 'fender'; there are: floor, hull"):
        simulated(tmp_path, robot(tmp_path, "", [device(Bumper, geoms="hull fender")]))
