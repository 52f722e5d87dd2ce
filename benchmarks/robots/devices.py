"""The processor time of each device of a simulated robot in a world tick of 50 ms. For information."""

from __future__ import annotations

import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

from benchmarks.harness import Effort, Result
from regraft.bus_schema.messages.devices.joints import GripperCommand, JointCommand, JointMode
from regraft.bus_schema.messages.devices.signals import Colour, RadioMessage, Sound
from regraft.component.component import declared
from regraft.sim_service.devices.core.device import Device
from regraft.sim_service.layout.scene import load_scene
from regraft.sim_service.robots import DeviceSpec, Place, RobotSpec
from regraft.sim_service.simulation import Simulation

TICKS = 400
WORLD = """<mujoco><option timestep=".002" jacobian="dense"/><worldbody><geom type="plane" size="5 5 .1"/>
<light pos="1 0 2"/><light pos="-1 0 2"/>{boxes}</worldbody></mujoco>"""
BOX = '<body name="box{0}" pos="{1} {2} .1"><geom type="box" size=".1 .1 .1"/></body>'
RING = "".join(f'<site name="ir{i}" pos="0 0 .05" euler="0 0 {45 * i}"/>' for i in range(8))
SITES = ("beacon", "microphone", "loudspeaker", "radio", "imu", "light_sensor")
ROBOT = f"""<mujoco><worldbody><body name="base"><freejoint/>
<geom name="lamp" type="cylinder" size=".035 .02" pos="0 0 .02" mass=".15"/>{RING}
{"".join(f'<site name="{name}" pos="0 0 .05"/>' for name in SITES)}
<body pos="0 0 .08"><joint name="left_finger" type="slide" axis="0 1 0" damping="2" armature=".005"/>
<geom size=".002"/></body>
<body pos=".02 0 .08"><joint name="right_finger" type="slide" axis="0 -1 0" damping="2" armature=".005"/>
<geom size=".002"/></body>
</body></worldbody><actuator><position name="grip" joint="left_finger" kp="60" kv="4"/></actuator></mujoco>"""
PACKAGE = "regraft.sim_service.devices."
DEVICES: dict[str, tuple[dict[str, Any], object]] = {
    "bumper:Bumper": ({}, None),
    "proximity:ProximityRing": ({"rate": 20.0}, None),
    "signals.beacon:BeaconReceiver": ({"rate": 20.0}, None),
    "light_sensor:LightSensor": ({"rate": 20.0}, None),
    "imu:InertialUnit": ({}, None),
    "joint_motors:JointMotors": ({"actuators": "grip"}, JointCommand(JointMode.POSITION, {"grip": 0.01})),
    "gripper:ParallelGripper": ({}, GripperCommand(0.01)),
    "signals.colour_lamp:ColourLamp": ({}, Colour(1.0, 0.0, 0.0)),
    "signals.sound:Loudspeaker": ({}, Sound("word")),
    "signals.sound:Microphone": ({"rate": 20.0}, None),
    "signals.radio:Radio": ({}, RadioMessage("word")),
}
"""Parameters of each device, at a measurement a tick, and a message that it gets at each tick."""


class _Sink:
    """Takes what a device publishes."""

    def publish(self, message: object) -> None:
        """Drop it."""


def devices(effort: Effort) -> list[Result]:
    """Measure each device in a world of 8 boxes and 3 other robots that shine, speak and send."""
    with tempfile.TemporaryDirectory() as folder:
        boxes = "".join(BOX.format(i, -1.5 + 0.4 * i, 1.0) for i in range(8))
        world, body = Path(folder, "world.xml"), Path(folder, "robot.xml")
        world.write_text(WORLD.format(boxes=boxes))
        body.write_text(ROBOT)
        return [_result(effort, world, body, name) for name in DEVICES]


def _result(effort: Effort, world: Path, body: Path, name: str) -> Result:
    rounds = [_microseconds(world, body, name, effort.count(TICKS, 20)) for _ in range(effort.rounds)]
    kind = name.partition(":")[2]
    return Result(f"device {kind}", statistics.median(rounds), "µs a tick", spread=(min(rounds), max(rounds)))


def _microseconds(world: Path, body: Path, name: str, ticks: int) -> float:
    parameters, message = DEVICES[name]
    spec = DeviceSpec("device", PACKAGE + name, parameters)
    others = tuple(
        DeviceSpec(kind, PACKAGE + path)
        for kind, path in (
            ("beacon", "signals.beacon:Beacon"),
            ("mouth", "signals.sound:Loudspeaker"),
            ("radio", "signals.radio:Radio"),
        )
    )
    robots = [RobotSpec("one", str(body), radius=0.05, place=Place(0.0, 0.0), devices=(spec,))]
    robots += [
        RobotSpec(f"other{i}", str(body), radius=0.05, place=Place(0.3 * (i + 1), 0.0), devices=others)
        for i in range(3)
    ]
    simulation = Simulation(load_scene(world, robots), 1)
    device = simulation.robot("one").devices["device"]
    for output in declared(type(device)).outputs:
        vars(device)[output] = _Sink()
    spent = 0.0
    for _ in range(ticks):
        for other in list(simulation.robots.values())[1:]:
            talking: Any = other.devices
            talking["mouth"].on_say(Sound("word", 60.0, 0.2))
            talking["radio"].on_send(RadioMessage("word"))
        simulation.advance(0.05)
        spent += _work(device, message)
    return spent / ticks * 1e6


def _work(device: Device, message: object) -> float:
    """Let a device do once more what it does in a tick of five control periods; return its processor time (s)."""
    begun = time.thread_time()
    if message is not None:
        for port in declared(type(device)).inputs.values():
            if port.handler_name is not None:
                getattr(device, port.handler_name)(message)
    for _ in range(5):
        device.act()
        device.watch()
    device.tick()
    device.sense()
    device.colours()
    return time.thread_time() - begun
