"""Promises about parallel grippers."""

from pathlib import Path
from typing import Any

import mujoco
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from regraft.bus_schema.messages.devices.joints import GripperCommand
from regraft.sim_service.devices.gripper import ParallelGripper
from regraft.sim_service.layout.scene import SceneError
from regraft.sim_service.simulation import Simulation

from .worlds import FLOOR, device, found, robot, run, simulated

GRIP = 'solref=".01 1" solimp=".95 .99 .001" friction="1 .02 .0005" condim="4" priority="1"'
HAND = f"""<body name="left" pos="0 0 .05"><joint name="left_finger" type="slide" axis="0 1 0" range="0 .03"
damping="2" armature=".005"/><geom type="box" pos="0 .004 0" size=".008 .004 .012" mass=".02" {GRIP}/></body>
<body name="right" pos="0 0 .05"><joint name="right_finger" type="slide" axis="0 -1 0" range="0 .03"
damping="2" armature=".005"/><geom type="box" pos="0 -.004 0" size=".008 .004 .012" mass=".02" {GRIP}/></body>
<body name="turner"><joint name="hinge"/><geom size=".001" mass=".01"/></body>"""
"""Two pads that meet in the middle; between them, `left_finger` and `right_finger` open to 60 mm."""
COUPLED = """<equality><joint joint1="left_finger" joint2="right_finger" solref=".005 1"/></equality>
<actuator><position name="grip" joint="left_finger" kp="60" kv="4"/>
<velocity name="fast" joint="hinge" kv="1"/></actuator>"""
IN_COUNTS = """<equality><joint joint1="left_finger" joint2="right_finger" solref=".005 1"/></equality>
<actuator><general name="grip" joint="left_finger" biastype="affine" gainprm=".01" biasprm="0 -60 -4"
ctrlrange="-1000 1000"/></actuator>"""
"""Fingers that are commanded in counts: 6000 for a metre."""
BLOCK = (
    '<body name="block" pos="0 0 .05"><freejoint/><geom type="box" size=".01 .01 .01" mass=".012" condim="4"/></body>'
)
STAND = '<body name="stand" pos="0 0 .02"><geom type="box" size=".005 .005 .02"/></body>'
EXACT: dict[str, Any] = {"width_noise": 0.0, "force_noise": 0.0}
ELLIPTIC = '<option cone="elliptic" impratio="10"/>'


def hand(folder: Path, body: str = FLOOR, extra: str = COUPLED, **how: Any) -> Simulation:
    """Return a gripper whose fingers are closed, or as far apart as a block in the world holds them."""
    grippers = [device(ParallelGripper, **{**EXACT, **how})]
    return simulated(folder, robot(folder, "", grippers, body=HAND, extra=extra), body=body, extra=ELLIPTIC)


def around_a_block(folder: Path, force: float | None = None, extra: str = COUPLED) -> Simulation:
    """Return an open gripper around a block on a stand, which is told to close."""
    simulation = hand(folder, FLOOR + BLOCK + STAND, extra)
    gripper = found(simulation, ParallelGripper)
    for position, _ in gripper._slides:
        gripper.kit.data.qpos[position] = 0.02
    gripper.on_command(GripperCommand(0.0, force))
    run(simulation, 1.0)
    return simulation


@settings(max_examples=10, deadline=None)
@given(st.floats(0.0, 0.06))
def test_a_width_is_reached(tmp_path_factory: pytest.TempPathFactory, width: float) -> None:
    simulation = hand(tmp_path_factory.mktemp("hand"))
    found(simulation, ParallelGripper).on_command(GripperCommand(width))
    run(simulation, 1.5)
    state = found(simulation, ParallelGripper).measure()
    assert state.width == pytest.approx(width, abs=1e-3)
    assert not state.holding


@pytest.mark.parametrize(("force", "pressed"), [(1.0, 1.0), (2.5, 2.5), (None, 4.0), (50.0, 4.0)])
def test_it_holds_a_block_with_the_force_that_it_is_given(tmp_path: Path, force: float | None, pressed: float) -> None:
    simulation = around_a_block(tmp_path, force)
    state = found(simulation, ParallelGripper).measure()
    assert state.holding
    assert state.width == pytest.approx(0.02, abs=1e-3)
    assert state.force == pytest.approx(pressed, rel=0.02)


def test_fingers_that_are_commanded_in_counts_reach_a_width_and_press_a_block(tmp_path: Path) -> None:
    simulation = hand(tmp_path, extra=IN_COUNTS)
    found(simulation, ParallelGripper).on_command(GripperCommand(0.03))
    run(simulation, 1.5)
    assert found(simulation, ParallelGripper).measure().width == pytest.approx(0.03, abs=1e-3)
    state = found(around_a_block(tmp_path, 2.5, IN_COUNTS), ParallelGripper).measure()
    assert state.holding
    assert state.force == pytest.approx(2.5, rel=0.02)


SIDES = "".join(f'<geom type="box" size=".1 .01 .1" pos="0 {y} .1"/>' for y in (0.03, -0.03))


@pytest.mark.parametrize(
    ("things", "opening", "holds"),
    [
        ('<geom type="plane" size="5 5 .1" pos="0 0 .0385"/>', 0.0, False),
        (SIDES, 0.0121, False),
        ('<geom type="box" size=".01 .01 .01" pos="0 0 .05"/>', 0.0099, True),
    ],
    ids=["a floor", "two walls", "a rail"],
)
def test_fingers_that_touch_the_world_hold_a_single_thing_of_it_and_no_floor(
    tmp_path: Path, things: str, opening: float, holds: bool
) -> None:
    gripper = found(hand(tmp_path, things), ParallelGripper)
    for position, _ in gripper._slides:
        gripper.kit.data.qpos[position] = opening
    mujoco.mj_forward(gripper.kit.model, gripper.kit.data)
    gripper.watch()
    assert len(gripper.kit.data.contact.geom) > 0
    assert gripper.measure().holding == holds


def test_a_held_block_does_not_fall_and_a_released_one_is_not_held(tmp_path: Path) -> None:
    simulation = around_a_block(tmp_path)
    gripper = found(simulation, ParallelGripper)
    data, stand = gripper.kit.data, simulation.scene.index("body", "stand")
    block = simulation.scene.index("body", "block")
    gripper.kit.model.body_pos[stand][2] = -1.0
    before = float(data.xpos[block][2])
    run(simulation, 1.0)
    assert float(data.xpos[block][2]) == pytest.approx(before, abs=1e-3)
    gripper.on_command(GripperCommand(0.05))
    run(simulation, 1.0)
    assert not gripper.measure().holding
    assert float(data.xpos[block][2]) < 0.02


def test_a_restored_run_goes_on_holding(tmp_path: Path) -> None:
    original = around_a_block(tmp_path, 2.0)
    successor = hand(tmp_path, FLOOR + BLOCK + STAND)
    successor.restore(original.snapshot())
    for simulation in (original, successor):
        run(simulation, 0.5)
    assert successor.digest() == original.digest()
    assert found(successor, ParallelGripper).measure() == found(original, ParallelGripper).measure()


def test_a_width_that_no_actuator_takes_is_refused_and_the_last_one_kept(tmp_path: Path) -> None:
    simulation = hand(tmp_path)
    gripper = found(simulation, ParallelGripper)
    gripper.on_command(GripperCommand(0.03))
    with pytest.raises(ValueError, match=r"'grip'.*beyond"):
        gripper.on_command(GripperCommand(1e12))
    run(simulation, 1.5)
    assert gripper.measure().width == pytest.approx(0.03, abs=1e-3)


def test_failures_add_a_bias_or_noise_to_the_width(tmp_path: Path) -> None:
    gripper = found(hand(tmp_path, bias=0.01), ParallelGripper)
    gripper.kit.failing = "bias"
    assert gripper.measure().width == pytest.approx(0.01)
    gripper.kit.failing = "noise"
    assert gripper.measure().width != 0.0


@pytest.mark.parametrize(
    ("settings", "complaint"),
    [
        ({"fingers": "left_finger"}, "must name two MJCF joints, not 'left_finger'"),
        ({"fingers": "left_finger thumb"}, "no joint named 'thumb'"),
        ({"fingers": "left_finger hinge"}, "joint 'hinge' must be a slide"),
        ({"actuators": "claw"}, "no actuator named 'claw'"),
        ({"actuators": "fast"}, "must name position actuators"),
    ],
)
def test_settings_that_do_not_fit_are_refused(tmp_path: Path, settings: dict[str, str], complaint: str) -> None:
    with pytest.raises(SceneError, match=complaint):
        hand(tmp_path, **settings)
