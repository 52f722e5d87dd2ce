"""FROG's world with its robot, without a bus, and shortcuts to the robot's devices."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from regraft.sim_service.contacts import ContactEvent
from regraft.sim_service.devices.core.failure_schedule import DRIFT, NONE
from regraft.sim_service.devices.drive import DifferentialDrive
from regraft.sim_service.devices.lidar import Lidar, Scan
from regraft.sim_service.devices.odometry import OdometryReading, WheelOdometry
from regraft.sim_service.layout.scene import Scene, load_scene
from regraft.sim_service.robots import DeviceSpec, Place, RobotSpec
from regraft.sim_service.simulated_robot import GroundTruth
from regraft.sim_service.simulation import Simulation
from tests.support.paths import FROG, ROOT

WORLD = FROG / "world.xml"
WAFFLE = ROOT / "regraft" / "robots" / "waffle" / "waffle.xml"
DEVICES = {
    "drive": "regraft.sim_service.devices.drive:DifferentialDrive",
    "odometry": "regraft.sim_service.devices.odometry:WheelOdometry",
    "scan": "regraft.sim_service.devices.lidar:Lidar",
    "charger": "regraft.sim_service.devices.charger:Charger",
}

Values = Mapping[str, Any]


def waffle(name: str = "", place: Place | None = None, devices: Mapping[str, Values] | None = None) -> RobotSpec:
    """Return FROG's robot; ``devices`` gives parameters by device."""
    specs = tuple(DeviceSpec(device, cls, dict((devices or {}).get(device, {}))) for device, cls in DEVICES.items())
    return RobotSpec(name, str(WAFFLE), radius=0.22, place=place, devices=specs)


def robots_as_data(**devices: Values) -> list[dict[str, Any]]:
    """Return FROG's robot as the parameter ``robots`` of the world, of cameras and of map servers."""
    listed = [{"name": name, "class": cls, "parameters": devices.get(name, {})} for name, cls in DEVICES.items()]
    return [{"name": "", "model": str(WAFFLE), "radius": 0.22, "devices": listed}]


FROG_WORLD = {"file": str(WORLD), "robots": robots_as_data()}
"""The parameters that the world, cameras and map servers of FROG's room have in common."""


def frog_scene(**devices: Values) -> Scene:
    """Return FROG's world with its robot; ``devices`` gives parameters by device."""
    return with_waffle(WORLD, **devices)


def with_waffle(world: Path, **devices: Values) -> Scene:
    """Return a world with FROG's robot."""
    return load_scene(world, (waffle(devices=devices),))


def send_command(simulation: Simulation, v: float, w: float) -> None:
    """Have the robot drive with v (m/s) and turn with w (rad/s)."""
    simulation.robot().device("drive", DifferentialDrive).command(v, w)


def odometry_of(simulation: Simulation) -> OdometryReading:
    """Return pose and twist by the wheels."""
    return simulation.robot().device("odometry", WheelOdometry).reading()


def turn_of(simulation: Simulation) -> Scan:
    """Return a turn of the lidar."""
    return simulation.robot().device("scan", Lidar).turn()


def truth_of(simulation: Simulation) -> GroundTruth:
    """Return where the robot really is."""
    return simulation.robot().truth(simulation.time)


def touched_by(simulation: Simulation) -> frozenset[str]:
    """Return the bodies that the robot touches."""
    return simulation.robot().contacts.touching(simulation.time)


def new_contacts(simulation: Simulation) -> tuple[ContactEvent, ...]:
    """Return the contacts that began since the last call."""
    return simulation.robot().contacts.take_events()


def set_drift(simulation: Simulation, *, lasts: bool) -> None:
    """Begin or end a drift of the odometry, by its parameters."""
    simulation.robot().device("odometry", WheelOdometry).kit.failing = DRIFT if lasts else NONE
