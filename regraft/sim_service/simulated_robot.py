"""One robot of a simulation: its base, its devices, its contacts, and the truth about it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

import mujoco
import numpy as np

from regraft.planar import Pose2D, Twist2D
from regraft.sim_service.contacts import ContactMonitor
from regraft.sim_service.devices.core.calling import call
from regraft.sim_service.devices.core.device import Device
from regraft.sim_service.layout.headings import yaw_of_matrix
from regraft.sim_service.layout.scene import Scene, SceneError
from regraft.sim_service.robots import RobotSpec

D = TypeVar("D", bound=Device)


@dataclass(frozen=True, slots=True)
class GroundTruth:
    """The truth: time (s), pose of the robot's base in the map frame, twist in the base frame."""

    time: float
    pose: Pose2D
    twist: Twist2D


class SimulatedRobot:
    """A robot of one running world.

    Attributes:
        spec: the robot as data.
        base: the number of its base's body.
        devices: its devices by name, in the order of its file.
        contacts: what it touches.

    Raises:
        SceneError: the world lacks its base.
    """

    def __init__(self, scene: Scene, data: mujoco.MjData, spec: RobotSpec) -> None:
        self.spec = spec
        self.base = scene.index("body", spec.body)
        self.devices: dict[str, Device] = {}
        self.contacts = ContactMonitor(scene, spec.body)
        self._data = data
        self._dof = None if scene.is_static(self.base) else scene.free_joint_dof(spec.body)

    def pose(self) -> Pose2D:
        """Return the pose of its base (map frame)."""
        position = self._data.xpos[self.base]
        return Pose2D(float(position[0]), float(position[1]), yaw_of_matrix(self._data.xmat[self.base]))

    def truth(self, time: float) -> GroundTruth:
        """Return where it really is at a time (s), and how it really moves."""
        if self._dof is None:
            return GroundTruth(time, self.pose(), Twist2D(0.0, 0.0))
        rotation = self._data.xmat[self.base]
        velocity = self._data.qvel[self._dof : self._dof + 6]
        forward = float(np.dot(rotation.reshape(3, 3)[:, 0], velocity[:3]))
        return GroundTruth(time, self.pose(), Twist2D(forward, float(velocity[5])))

    def device(self, name: str, kind: type[D]) -> D:
        """Return a device of a kind; raises SceneError if there is none."""
        found = self.devices.get(name)
        if not isinstance(found, kind):
            there = ", ".join(self.devices) or "none"
            raise SceneError(f"the robot {self.spec.name!r} has no {kind.__name__} {name!r}; its devices: {there}")
        return found

    def snapshot(self) -> dict[str, Any]:
        """Return the state that is not part of the physics, as plain data."""
        devices = {name: call(device, device.snapshot) for name, device in self.devices.items()}
        return {"contacts": self.contacts.snapshot(), "devices": devices}

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        """Continue from a snapshot of the same robot with the same devices."""
        self.contacts.restore(snapshot["contacts"])
        for name, device in self.devices.items():
            state = snapshot["devices"].get(name)
            if state is not None:
                call(device, device.restore, state)
