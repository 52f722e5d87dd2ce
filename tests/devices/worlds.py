"""Small worlds with small robots, and ears for their devices' outputs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from regraft.bus_schema.encoding.records import record_shape
from regraft.sim_service.devices.core.device import Device
from regraft.sim_service.layout.scene import load_scene
from regraft.sim_service.robots import DeviceSpec, Place, RobotSpec
from regraft.sim_service.simulation import Simulation
from regraft.sim_service.world import World
from regraft.testing import Rig

D = TypeVar("D", bound=Device)

OPTION = '<option timestep=".002" integrator="implicitfast" jacobian="dense"/>'
FLOOR = '<geom name="floor" type="plane" size="5 5 .1"/>'
WALL = '<body name="wall" pos="1 0 .2"><geom name="wall" type="box" size=".05 1 .2"/></body>'
PUCK = """<geom name="hull" type="cylinder" size=".035 .02" pos="0 0 .02" mass=".15"/>
<site name="front" pos=".035 0 .02"/><site name="top" pos="0 0 .04" euler="0 -90 0"/>"""
"""An e-puck's hull with its bottom at the base's origin; `front` looks forward, `top` upward (along their x axes)."""
TICK = 0.05


@dataclass
class Ear:
    """Takes the place of an output and keeps what is published."""

    heard: list[Any] = field(default_factory=list)

    def publish(self, message: Any) -> None:
        """Keep a message."""
        self.heard.append(message)


def device(kind: type[Device], name: str = "device", **parameters: Any) -> DeviceSpec:
    """Return a device of a class as data."""
    return DeviceSpec(name, f"{kind.__module__}:{kind.__name__}", parameters)


def world_file(folder: Path, body: str = FLOOR, extra: str = "") -> Path:
    """Write a world's MJCF file."""
    file = folder / "world.xml"
    file.write_text(f"<mujoco>{OPTION}{extra}<worldbody>{body}</worldbody></mujoco>")
    return file


def robot(
    folder: Path,
    name: str,
    devices: Sequence[DeviceSpec] = (),
    at: tuple[float, float, float] = (0.0, 0.0, 0.0),
    *,
    body: str = PUCK,
    extra: str = "",
    moves: bool = False,
) -> RobotSpec:
    """Write a robot's MJCF file and return the robot; it stands still unless it ``moves``."""
    file = folder / f"{name or 'robot'}.xml"
    joint = "<freejoint/>" if moves else ""
    file.write_text(f'<mujoco>{OPTION}<worldbody><body name="base">{joint}{body}</body></worldbody>{extra}</mujoco>')
    return RobotSpec(name, str(file), radius=0.03, place=Place(*at), devices=tuple(devices))


def simulated(folder: Path, *robots: RobotSpec, body: str = FLOOR, extra: str = "", seed: int = 1) -> Simulation:
    """Return the simulation of a world with robots."""
    return Simulation(load_scene(world_file(folder, body, extra), robots), seed)


def found(simulation: Simulation, kind: type[D], name: str = "device", of: str = "") -> D:
    """Return a device of a robot."""
    return simulation.robot(of).device(name, kind)


def listen(simulation: Simulation, port: str, name: str = "device", of: str = "") -> list[Any]:
    """Return the list of what a device publishes from now on."""
    ear = Ear()
    vars(simulation.robot(of).devices[name])[port] = ear
    return ear.heard


def run(simulation: Simulation, seconds: float = TICK) -> None:
    """Let time pass as the world does: the physics of a tick, then all devices sense if somebody listens to them."""
    for _ in range(round(seconds / TICK)):
        simulation.progress.stamp = simulation.time + TICK
        simulation.advance(TICK)
        for one in simulation.robots.values():
            for part in one.devices.values():
                if any(isinstance(value, Ear) for value in vars(part).values()):
                    part.sense()


def world_on(rig: Rig, folder: Path, *robots: RobotSpec, body: str = FLOOR, extra: str = "") -> World:
    """Add a world with robots to a rig, as the component that a stack has."""
    return rig.add(World, parameters=on_bus(folder, *robots, body=body, extra=extra))


def on_bus(folder: Path, *robots: RobotSpec, body: str = FLOOR, extra: str = "") -> dict[str, Any]:
    """Return the parameters with which a world and its cameras know the same robots."""
    file = world_file(folder, body, extra)
    return {"file": str(file), "robots": [record_shape(RobotSpec).pack(spec) for spec in robots]}


def tick(rig: Rig, world: World, count: int = 1) -> None:
    """Let time pass as the source of simulated time does."""
    for _ in range(count):
        rig.clock.advance_to(rig.clock.now() + round(TICK * 1e9))
        world.advance(world.ticks, TICK)
        rig.settle()
