"""Promises that all sensors keep: how they fail, and that a restored run goes on as the one before."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.devices.joints import JointCommand, JointMode
from regraft.bus_schema.messages.devices.signals import Colour, RadioMessage, Sound
from regraft.bus_schema.messages.protocol.control import Snapshot
from regraft.component.component import declared
from regraft.sim_service.devices.bumper import Bumper
from regraft.sim_service.devices.core.sensor import Sensor
from regraft.sim_service.devices.gripper import ParallelGripper
from regraft.sim_service.devices.imu import InertialUnit
from regraft.sim_service.devices.joint_motors import JointMotors
from regraft.sim_service.devices.light_sensor import LightSensor
from regraft.sim_service.devices.proximity import ProximityRing
from regraft.sim_service.devices.signals.beacon import Beacon, BeaconReceiver
from regraft.sim_service.devices.signals.colour_lamp import ColourLamp
from regraft.sim_service.devices.signals.radio import Radio
from regraft.sim_service.devices.signals.sound import Loudspeaker, Microphone
from regraft.sim_service.robots import DeviceSpec, RobotSpec
from regraft.sim_service.simulation import Simulation
from regraft.testing import Rig

from .worlds import device, listen, robot, run, simulated, tick, world_on

SITES = "".join(f'<site name="{name}" pos="0 0 .05"/>' for name in ("beacon", "microphone", "loudspeaker", "radio"))
BODY = f"""<geom name="hull" type="cylinder" size=".035 .02" pos="0 0 .02" mass=".15"/>{SITES}
<site name="front" pos=".035 0 .02"/><site name="top" pos="0 0 .04" euler="0 -90 0"/>
<body pos="0 0 .08"><joint name="left_finger" type="slide" axis="0 1 0" range="0 .03" damping="2" armature=".005"/>
<geom type="box" size=".002 .002 .002"/></body>
<body pos=".02 0 .08"><joint name="right_finger" type="slide" axis="0 -1 0" range="0 .03" damping="2" armature=".005"/>
<geom type="box" size=".002 .002 .002"/></body>"""
ACTUATORS = '<actuator><position name="grip" joint="left_finger" kp="60" kv="4"/></actuator>'
SENSORS: dict[type[Sensor], dict[str, Any]] = {
    Bumper: {},
    ProximityRing: {"sites": "front"},
    BeaconReceiver: {},
    LightSensor: {"site": "top"},
    InertialUnit: {"site": "front"},
    JointMotors: {"actuators": "grip"},
    ParallelGripper: {},
    Microphone: {},
}
LAMP = '<geom type="plane" size="5 5 .1"/><light pos="0 0 2" attenuation="0 0 1" exponent="0"/>'


def team(folder: Path, *own: DeviceSpec) -> tuple[RobotSpec, RobotSpec]:
    """Return a robot with devices, and one near by that shines, speaks and sends."""
    others = [device(Beacon, "beacon"), device(Loudspeaker, "mouth"), device(Radio, "radio")]
    return (
        robot(folder, "one", own, body=BODY, extra=ACTUATORS, moves=True),
        robot(folder, "two", others, (0.09, 0.0, 0.0), body=BODY, moves=True),
    )


@pytest.mark.parametrize("kind", SENSORS)
def test_a_silent_sensor_sends_nothing_and_a_frozen_one_its_last_message(tmp_path: Path, kind: type[Sensor]) -> None:
    spec = device(kind, "part", **SENSORS[kind])
    message = declared(kind).outputs[kind.measures].message
    with Rig(seed=5) as rig:
        world = world_on(rig, tmp_path, *team(tmp_path, spec), body=LAMP)
        messages = rig.collect(f"one/{kind.measures}", message)
        counts = []
        for failure in ("none", "silent", "frozen"):
            rig.runtimes["world"].parameters.set({"one/part_failure": failure})
            before = len(messages)
            tick(rig, world, 8)
            counts.append(len(messages) - before)
    assert counts[0] == counts[2] > 0
    assert counts[1] == 0
    frozen = messages[counts[0] :]
    last = messages[counts[0] - 1]
    assert [codec.encode(replace(one, stamp=0.0)) for one in frozen] == [codec.encode(replace(last, stamp=0.0))] * len(
        frozen
    )
    assert frozen[-1].stamp > last.stamp


def everything(folder: Path) -> Simulation:
    """Return two robots, one of which has every sensor."""
    sensors = [device(kind, kind.measures, **how) for kind, how in SENSORS.items() if kind is not JointMotors]
    own = [*sensors, device(Radio, "radio"), device(ColourLamp, "lamp", geom="hull")]
    return simulated(folder, *team(folder, *own), body=LAMP)


def perform(simulation: Simulation, ticks: int) -> list[bytes]:
    """Let the second robot act and return all that the first one senses."""
    heard: list[Any] = []
    ears = [listen(simulation, kind.measures, kind.measures, "one") for kind in SENSORS if kind is not JointMotors]
    ears.append(listen(simulation, "received", "radio", "one"))
    two: Any = simulation.robot("two").devices
    one: Any = simulation.robot("one").devices
    for _ in range(ticks):
        moment = round(simulation.time / 0.05)
        if moment % 3 == 0:
            two["mouth"].on_say(Sound(f"word {moment}", 60.0, 0.2))
            one["lamp"].on_colour(Colour(moment % 7 / 7.0, 0.2, 0.3))
        two["radio"].on_send(RadioMessage(str(moment)))
        run(simulation)
    for ear in ears:
        heard += ear
    assert heard
    return [*(codec.encode(message) for message in heard), repr(simulation.render_state().colours).encode()]


def test_a_restored_run_senses_what_the_one_before_senses(tmp_path: Path) -> None:
    original, successor = everything(tmp_path), everything(tmp_path)
    perform(original, 7)
    taken = codec.encode(Snapshot("world", 1, 0.0, 3, original.snapshot()))
    successor.restore(codec.decode(taken, Snapshot).state)
    assert perform(successor, 12) == perform(original, 12)
    assert successor.digest() == original.digest()


def test_a_command_for_a_joint_that_is_not_there_is_a_fault_of_the_world(tmp_path: Path) -> None:
    spec = device(JointMotors, "motors", actuators="grip")
    with Rig() as rig:
        world = world_on(rig, tmp_path, *team(tmp_path, spec), body=LAMP)
        rig.publish("one/joint_command", JointCommand(JointMode.POSITION, {"knee": 1.0}))
        tick(rig, world)
        (fault,) = rig.take_faults()
    assert "has no joint 'knee'; it has: grip" in fault
    assert world.ticks == 1
