"""Promises about motors of joints."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from regraft.bus_schema.messages.devices.joints import JointCommand, JointMode, JointState, JointStates
from regraft.bus_schema.messages.world import GroundTruth
from regraft.bus_schema.model.lifecycle import State
from regraft.component.component import parameter_set
from regraft.sim_service.devices.joint_motors import JointMotors
from regraft.sim_service.layout.scene import SceneError
from regraft.sim_service.robots import DeviceSpec, RobotSpec
from regraft.sim_service.simulation import Simulation
from regraft.sim_service.stability import UnstablePhysics
from regraft.sim_service.world import World
from regraft.testing import Rig

from .worlds import device, found, on_bus, robot, run, simulated, tick, world_on

ARM = """<body name="link" pos="0 0 .5"><joint name="elbow" axis="0 0 1" damping=".01"/>
<geom type="box" size=".1 .01 .01" pos=".1 0 0" mass=".3" contype="0" conaffinity="0"/>
<body name="rail" pos="0 0 .3"><joint name="lift" type="slide" axis="1 0 0" range="-1 1"/>
<geom size=".02" mass=".1" contype="0" conaffinity="0"/></body></body>"""
ACTUATORS = {
    "position": '<position name="elbow" joint="elbow" kp="20" kv="1" gear="2"/>',
    "velocity": '<velocity name="elbow" joint="elbow" kv="1" gear="2"/>',
    "torque": '<motor name="elbow" joint="elbow" gear="5"/>',
    "counts": '<general name="elbow" joint="elbow" gear="2" biastype="affine" gainprm=".1" biasprm="0 -20 -1"/>',
    "speed counts": '<general name="elbow" joint="elbow" gear="2" biastype="affine" gainprm=".1" biasprm="0 0 -1"/>',
    "filtered": '<position name="elbow" joint="elbow" kp="20" kv="1" timeconst=".05"/>',
    "unused bias": '<general name="elbow" joint="elbow" gainprm="2" biasprm="0 -20 -1"/>',
    "integrator": '<intvelocity name="elbow" joint="elbow" kp="20" actrange="-3 3"/>',
    "damper": '<damper name="elbow" joint="elbow" kv="1" ctrlrange="0 1"/>',
    "offset": '<general name="elbow" joint="elbow" biastype="affine" gainprm="20" biasprm="1 -20 -1"/>',
}
EXACT: dict[str, Any] = {"resolution": 0.0, "velocity_noise": 0.0, "torque_noise": 0.0}


def moved(folder: Path, kind: str, **how: Any) -> Simulation:
    """Return an arm whose elbow has an actuator of a kind."""
    motors = device(JointMotors, **{"actuators": "elbow", **EXACT, **how})
    extra = f'<actuator>{ACTUATORS[kind]}<motor name="ball" site="front" gear="1 0 0 0 0 0"/></actuator>'
    body = ARM + '<site name="front"/>'
    return simulated(folder, robot(folder, "", [motors], body=body, extra=extra))


def command(simulation: Simulation, mode: JointMode, value: float, joint: str = "elbow") -> None:
    """Give the elbow a command."""
    found(simulation, JointMotors).on_command(JointCommand(mode, {joint: value}))


def elbow(simulation: Simulation) -> JointState:
    """Return the measured state of the elbow."""
    return found(simulation, JointMotors).measure().joints["elbow"]


@pytest.mark.parametrize("kind", ["position", "counts", "filtered"])
def test_a_position_is_reached_and_held(tmp_path: Path, kind: str) -> None:
    simulation = moved(tmp_path, kind)
    command(simulation, JointMode.POSITION, 0.7)
    run(simulation, 3.0)
    assert list(found(simulation, JointMotors).measure().joints) == ["elbow"]
    states = elbow(simulation)
    assert states.position == pytest.approx(0.7, abs=1e-3)
    assert states.velocity == pytest.approx(0.0, abs=1e-3)


def test_without_a_command_a_position_stays_that_of_the_start(tmp_path: Path) -> None:
    simulation = moved(tmp_path, "position")
    run(simulation, 1.0)
    assert elbow(simulation).position == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("kind", ["velocity", "speed counts"])
def test_a_velocity_holds_until_it_times_out(tmp_path: Path, kind: str) -> None:
    simulation = moved(tmp_path, kind)
    command(simulation, JointMode.VELOCITY, 0.5)
    run(simulation, 0.45)
    assert elbow(simulation).velocity == pytest.approx(0.5, rel=0.02)
    run(simulation, 0.5)
    assert elbow(simulation).velocity == pytest.approx(0.0, abs=0.02)


@pytest.mark.parametrize("kind", ["torque", "unused bias"])
def test_a_torque_accelerates_as_inertia_says(tmp_path: Path, kind: str) -> None:
    simulation = moved(tmp_path, kind)
    motors = found(simulation, JointMotors)
    motors.kit.model.dof_damping[:] = 0.0
    command(simulation, JointMode.TORQUE, 0.02)
    run(simulation, 0.2)
    states = elbow(simulation)
    box = 0.3 * (0.2**2 + 0.02**2) / 12.0 + 0.3 * 0.1**2
    ball = 0.4 * 0.1 * 0.02**2
    assert states.torque == pytest.approx(0.02)
    assert states.velocity == pytest.approx(0.02 / (box + ball) * 0.2, rel=1e-3)


def test_positions_come_in_steps_and_the_rest_with_noise(tmp_path: Path) -> None:
    simulation = moved(tmp_path, "position", resolution=0.1, velocity_noise=0.02, torque_noise=0.3)
    command(simulation, JointMode.POSITION, 0.74)
    run(simulation, 3.0)
    values = []
    for _ in range(300):
        run(simulation)
        states = elbow(simulation)
        assert states.position == pytest.approx(0.7)
        values.append([states.velocity, states.torque])
    assert np.std(values, axis=0) == pytest.approx([0.02, 0.3], rel=0.15)


@pytest.mark.parametrize(
    ("joint", "mode", "complaint"),
    [
        ("knee", JointMode.POSITION, "device has no joint 'knee'; it has: elbow"),
        ("elbow", JointMode.TORQUE, "'elbow' takes commands of position, not of torque"),
    ],
)
def test_a_command_that_does_not_fit_is_refused_whole(
    tmp_path: Path, joint: str, mode: JointMode, complaint: str
) -> None:
    simulation = moved(tmp_path, "position")
    with pytest.raises(ValueError, match=complaint):
        command(simulation, mode, 0.7, joint)
    run(simulation, 0.5)
    assert elbow(simulation).position == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(("kind", "value"), [("position", 1e11), ("position", math.nan), ("torque", -1e12)])
def test_a_command_whose_signal_no_actuator_takes_is_refused_whole(tmp_path: Path, kind: str, value: float) -> None:
    simulation = moved(tmp_path, kind)
    with pytest.raises(ValueError, match=r"'elbow'.*beyond"):
        command(simulation, JointMode(kind), value)
    run(simulation, 0.5)
    assert elbow(simulation).position == pytest.approx(0.0, abs=1e-6)


@pytest.fixture
def in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Have MuJoCo write the file of its warnings where it is in nobody's way."""
    monkeypatch.chdir(tmp_path)


def with_a_cart(folder: Path) -> list[RobotSpec]:
    """Return an arm whose elbow has a motor, and a cart at another place than its MJCF's."""
    motors = device(JointMotors, **{"actuators": "elbow", **EXACT})
    return [
        robot(folder, "cart", at=(2.0, 1.0, 0.0), moves=True),
        robot(folder, "arm", [motors], body=ARM, extra=f"<actuator>{ACTUATORS['torque']}</actuator>"),
    ]


@pytest.mark.usefixtures("in_a_folder_of_its_own")
def test_physics_that_becomes_unstable_is_an_error_with_its_joint_and_moves_no_other_robot(tmp_path: Path) -> None:
    simulation = simulated(tmp_path, *with_a_cart(tmp_path))
    run(simulation)
    found(simulation, JointMotors, of="arm").on_command(JointCommand(JointMode.TORQUE, {"elbow": 1e9}))
    for _ in range(2):
        with pytest.raises(UnstablePhysics, match="joint 'arm/elbow' of the robot 'arm'") as raised:
            run(simulation)
        assert (raised.value.robot, raised.value.element) == ("arm", "arm/elbow")
    cart = simulation.robot("cart").pose()
    assert (cart.x, cart.y) == pytest.approx((2.0, 1.0), abs=1e-3)


@pytest.mark.usefixtures("in_a_folder_of_its_own")
def test_a_signal_that_no_actuator_takes_is_an_error_with_its_actuator(tmp_path: Path) -> None:
    simulation = simulated(tmp_path, *with_a_cart(tmp_path))
    kit = found(simulation, JointMotors, of="arm").kit
    kit.data.qpos[kit.model.jnt_qposadr[kit.index("joint", "elbow")]] = math.inf
    with pytest.raises(UnstablePhysics, match="position of the joint 'arm/elbow'"):
        run(simulation)
    simulation = simulated(tmp_path, *with_a_cart(tmp_path))
    found(simulation, JointMotors, of="arm")._targets["elbow"] = math.nan
    with pytest.raises(UnstablePhysics, match="control signal of the actuator 'arm/elbow' of the robot 'arm'"):
        run(simulation)


@pytest.mark.usefixtures("in_a_folder_of_its_own")
def test_a_world_whose_physics_becomes_unstable_fails_and_names_the_robot(tmp_path: Path) -> None:
    with Rig() as rig:
        world = world_on(rig, tmp_path, *with_a_cart(tmp_path))
        truths = rig.collect("cart/ground_truth", GroundTruth)
        tick(rig, world)
        rig.publish("arm/joint_command", JointCommand(JointMode.TORQUE, {"elbow": 1e9}))
        tick(rig, world)
        assert rig.state("world") is State.UNCONFIGURED
        assert "joint 'arm/elbow' of the robot 'arm'" in rig.status("world").failure
        (told,) = (event for event in rig.events if event.kind == "world.unstable")
        assert told.details == {"robot": "arm", "element": "arm/elbow"}
    assert len(truths) == 1


@pytest.mark.usefixtures("in_a_folder_of_its_own")
def test_a_world_whose_physics_is_unstable_at_once_is_refused_before_it_starts(tmp_path: Path) -> None:
    stiff = ARM.replace('damping=".01"', 'stiffness="1e15" springref="90"')
    values = parameter_set(World, on_bus(tmp_path, robot(tmp_path, "arm", body=stiff))).values
    with pytest.raises(UnstablePhysics, match="acceleration of the joint 'arm/elbow'"):
        World.check_parameters(values, 1)


@pytest.mark.parametrize(("moves", "refuses"), [("elbow", "neck"), ("lift", "arm")])
def test_of_two_that_share_a_port_each_takes_or_refuses_a_command_for_itself(
    tmp_path: Path, moves: str, refuses: str
) -> None:
    arm = device(JointMotors, "arm", actuators="elbow")
    neck = DeviceSpec("neck", arm.cls, {"actuators": "lift"}, {"joint_states": "neck_states"})
    both = "".join(f'<position name="{name}" joint="{name}" kp="20" kv="1"/>' for name in ("elbow", "lift"))
    with Rig() as rig:
        one = robot(tmp_path, "one", [arm, neck], body=ARM, extra=f"<actuator>{both}</actuator>")
        world = world_on(rig, tmp_path, one)
        topics = {"elbow": "one/joint_states", "lift": "one/neck_states"}
        states = {name: rig.collect(topic, JointStates) for name, topic in topics.items()}
        rig.publish("one/joint_command", JointCommand(JointMode.POSITION, {moves: 0.5}))
        tick(rig, world, 40)
        (fault,) = rig.take_faults()
    positions = {name: heard[-1].joints[name].position for name, heard in states.items()}
    assert positions == {"elbow": 0.0, "lift": 0.0, moves: pytest.approx(0.5, abs=0.01)}
    assert f"the device '{refuses}' of the robot 'one': {refuses} has no joint '{moves}'" in fault


def test_failures_add_a_bias_or_noise_to_positions(tmp_path: Path) -> None:
    simulation = moved(tmp_path, "position", bias=0.3)
    motors = found(simulation, JointMotors)
    motors.kit.failing = "bias"
    assert elbow(simulation).position == pytest.approx(0.3)
    motors.kit.failing = "noise"
    assert elbow(simulation).position != 0.0


@pytest.mark.parametrize("kind", ["position", "velocity", "torque"])
def test_a_restored_run_goes_on_with_its_commands(tmp_path: Path, kind: str) -> None:
    original, successor = moved(tmp_path, kind), moved(tmp_path, kind)
    command(original, JointMode(kind), 0.05)
    run(original, 0.3)
    successor.restore(original.snapshot())
    for simulation in (original, successor):
        run(simulation, 0.5)
    assert successor.digest() == original.digest()
    assert abs(float(found(original, JointMotors).kit.data.qpos[0])) > 1e-4


@pytest.mark.parametrize(
    ("actuators", "complaint"),
    [
        ("elbow knee", r"no actuator named 'knee'; there are: elbow, ball"),
        ("ball", "actuator 'ball' must move a hinge or a slide"),
        ("", "must name at least one MJCF actuator"),
    ],
)
def test_actuators_that_do_not_fit_are_refused(tmp_path: Path, actuators: str, complaint: str) -> None:
    with pytest.raises(SceneError, match=complaint):
        moved(tmp_path, "position", actuators=actuators)


@pytest.mark.parametrize("kind", ["integrator", "damper", "offset"])
def test_an_actuator_that_takes_neither_position_nor_velocity_nor_torque_is_refused(tmp_path: Path, kind: str) -> None:
    with pytest.raises(SceneError, match="actuator 'elbow' must take a position, a velocity or a torque"):
        moved(tmp_path, kind)


def test_encoders_of_a_turn_have_4096_steps() -> None:
    assert JointMotors.resolution.default == pytest.approx(math.radians(0.08789), rel=1e-4)
