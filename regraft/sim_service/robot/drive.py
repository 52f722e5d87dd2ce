"""Differential drive: from a commanded twist to the speeds of two wheels."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import mujoco

from regraft.planar import Twist2D
from regraft.sim_service.layout.scene import Scene, SceneError


@dataclass(frozen=True, slots=True)
class DriveSettings:
    """Names of the robot's elements in the MJCF, and for how long (s) a command holds.

    A wheel's joint and its velocity actuator share a name. Wheel radius, track and largest wheel speed are
    read from the model: from the wheel's geom, the positions of the wheels' bodies, and the actuators'
    control ranges.
    """

    body: str = "base"
    left_wheel: str = "left_wheel"
    right_wheel: str = "right_wheel"
    timeout: float = 0.5


class DifferentialDrive:
    """Holds the last command and turns it into wheel speeds.

    Raises:
        SceneError: an element is missing, the wheels' radii differ, or an actuator has no control range.
    """

    def __init__(self, scene: Scene, settings: DriveSettings) -> None:
        wheels = (settings.left_wheel, settings.right_wheel)
        self.base = scene.index("body", settings.body)
        joints = [scene.index("joint", wheel) for wheel in wheels]
        self._actuators = [scene.index("actuator", wheel) for wheel in wheels]
        model = scene.model
        self.angle_addresses = tuple(int(model.jnt_qposadr[joint]) for joint in joints)
        """Where the wheels' angles (rad; left, right) stand in qpos."""
        self.wheel_radius = _wheel_radius(scene, wheels, joints)
        left, right = (int(model.jnt_bodyid[joint]) for joint in joints)
        self.track = float(model.body_pos[left][1] - model.body_pos[right][1])
        """Distance (m) between the wheels' middles."""
        if self.track <= 0.0:
            raise SceneError(f"{scene.path}: {wheels[0]!r} must stand at larger y in the base than {wheels[1]!r}")
        self._largest_speed = min(_largest_control(scene, wheel) for wheel in wheels)
        self._timeout = settings.timeout
        self._command = Twist2D(0.0, 0.0)
        self._command_time = -math.inf

    def command(self, v: float, w: float, time: float) -> None:
        """Take a command, given at a time (s), to drive forward with v (m/s) and turn with w (rad/s).

        Raises:
            ValueError: v or w is not finite.
        """
        if not (math.isfinite(v) and math.isfinite(w)):
            raise ValueError(f"a velocity command must be finite, not v={v}, w={w}")
        self._command = Twist2D(v, w)
        self._command_time = time

    def wheel_speeds(self, v: float, w: float) -> tuple[float, float]:
        """Return the left and right wheel speeds (rad/s) for a twist.

        If one wheel would be too fast, both are slowed by the same factor, so that the path keeps its
        curvature.
        """
        left = (v - w * self.track / 2.0) / self.wheel_radius
        right = (v + w * self.track / 2.0) / self.wheel_radius
        fastest = max(abs(left), abs(right))
        scale = min(1.0, self._largest_speed / fastest) if fastest > 0.0 else 1.0
        return left * scale, right * scale

    def apply(self, data: mujoco.MjData, time: float) -> None:
        """Write the wheel speeds at a time (s) to the actuators: zero once the command is too old."""
        expired = time - self._command_time > self._timeout - 1e-9
        left, right = (0.0, 0.0) if expired else self.wheel_speeds(self._command.v, self._command.w)
        data.ctrl[self._actuators[0]] = left
        data.ctrl[self._actuators[1]] = right

    def snapshot(self) -> dict[str, Any]:
        """Return the last command as plain data."""
        never = math.isinf(self._command_time)
        return {"v": self._command.v, "w": self._command.w, "time": None if never else self._command_time}

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        """Take over the command of a snapshot."""
        self._command = Twist2D(float(snapshot["v"]), float(snapshot["w"]))
        self._command_time = -math.inf if snapshot["time"] is None else float(snapshot["time"])


def _wheel_radius(scene: Scene, wheels: tuple[str, str], joints: list[int]) -> float:
    radii = []
    for wheel, joint in zip(wheels, joints, strict=True):
        geom = int(scene.model.body_geomadr[scene.model.jnt_bodyid[joint]])
        if geom < 0:
            raise SceneError(f"{scene.path}: the body of joint {wheel!r} has no geom to be a wheel")
        radii.append(float(scene.model.geom_size[geom][0]))
    if radii[0] != radii[1]:
        raise SceneError(f"{scene.path}: wheels {wheels[0]!r} and {wheels[1]!r} have different radii {radii}")
    return radii[0]


def _largest_control(scene: Scene, wheel: str) -> float:
    actuator = scene.index("actuator", wheel)
    if not scene.model.actuator_ctrllimited[actuator]:
        raise SceneError(f"{scene.path}: actuator {wheel!r} needs a ctrlrange (rad/s)")
    low, high = scene.model.actuator_ctrlrange[actuator]
    return float(min(-low, high))
