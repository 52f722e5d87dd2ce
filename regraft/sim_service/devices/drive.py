"""Differential drive: from a commanded twist to the speeds of two wheels."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

import mujoco
import numpy as np

from regraft import Input, Parameter
from regraft.bus_schema.messages.devices.joints import JointMode
from regraft.bus_schema.messages.geometry import Twist
from regraft.bus_schema.messages.power import BatteryState
from regraft.planar import Twist2D
from regraft.sim_service.devices.core.device import Device
from regraft.sim_service.devices.core.device_kit import DeviceKit
from regraft.sim_service.devices.servo import Servo, servo
from regraft.sim_service.layout.scene import SceneError

ROUND = {
    int(kind)
    for kind in (
        mujoco.mjtGeom.mjGEOM_SPHERE,
        mujoco.mjtGeom.mjGEOM_ELLIPSOID,
        mujoco.mjtGeom.mjGEOM_CYLINDER,
        mujoco.mjtGeom.mjGEOM_CAPSULE,
    )
}
"""The kinds of geoms whose first size is a radius."""
MOST_LEANING = math.radians(10.0)
"""Angle (rad) by which a wheel's axis may miss the base's y: so far its speed is right to 2 %."""


class DifferentialDrive(Device):
    """Turns the last command into wheel speeds, and stops when commands stay away or the battery is empty.

    A wheel's joint and its velocity actuator share a name, and the joint's axis points to the left. Wheel radius, track
    and largest wheel speed are read from the model: from the wheel's first round geom, the positions of the wheels'
    bodies, and the actuators' control ranges.
    """

    velocity = Input(Twist, description="what the robot shall do now: forward velocity and yaw rate", required=False)
    battery = Input(BatteryState, latest_only=True, required=False, description="whether there is power to drive")

    left_wheel = Parameter("left_wheel", "joint and actuator of the left wheel", read_only=True)
    right_wheel = Parameter("right_wheel", "joint and actuator of the right wheel", read_only=True)
    timeout = Parameter(0.5, "how long a command holds", minimum=0.0, unit="s", read_only=True)

    def build(self) -> None:
        """Find the wheels.

        Raises:
            SceneError: an element is missing; the wheels' radii differ; an axis does not point to the left; an
                actuator takes no velocities, or has no control range.
        """
        kit, model = self.kit, self.kit.model
        wheels = (self.left_wheel, self.right_wheel)
        joints = [kit.index("joint", wheel) for wheel in wheels]
        self._left, self._right = (_velocity_servo(kit, wheel) for wheel in wheels)
        self.angle_addresses = tuple(int(model.jnt_qposadr[joint]) for joint in joints)
        """The indices of the wheels' angles (rad; left, right) in qpos."""
        self.wheel_radius = _wheel_radius(kit, wheels, joints)
        left, right = (int(model.jnt_bodyid[joint]) for joint in joints)
        self.track = _left_of_base(kit, left) - _left_of_base(kit, right)
        """Distance (m) between the wheels' middles."""
        if self.track <= 0.0:
            raise SceneError(f"{kit.scene.path}: {wheels[0]!r} must stand at larger y in the base than {wheels[1]!r}")
        for wheel, joint in zip(wheels, joints, strict=True):
            _check_axis(kit, wheel, joint)
        self._largest_speed = min(_largest_speed(kit, one) for one in (self._left, self._right))
        self._timeout = self.timeout
        self._command = Twist2D(0.0, 0.0)
        self._command_time = -math.inf
        self._powered = True

    @velocity.handler
    def on_velocity(self, twist: Twist) -> None:
        """Drive on like this until the next command, or until it times out; an empty battery turns no wheel."""
        if self._powered:
            self.command(twist.forward, twist.turn)

    @battery.handler
    def on_battery(self, battery: BatteryState) -> None:
        """Forget the command once the battery is empty, and report when there is no power and when there is again."""
        powered = battery.energy > 0.0
        if powered == self._powered:
            return
        self._powered = powered
        if not powered:
            self._command_time = -math.inf
        name = self.kit.robot.name
        who = f"the robot {name}" if name else "the robot"
        again = f"there is power for {who} to drive again" if name else "there is power to drive again"
        text = again if powered else f"the battery is empty: {who} stands still"
        self.kit.event("world.power", text, robot=name, powered=powered)

    def command(self, v: float, w: float) -> None:
        """Drive forward with v (m/s) and turn with w (rad/s) from now on.

        Raises:
            ValueError: v or w is not finite.
        """
        if not (math.isfinite(v) and math.isfinite(w)):
            raise ValueError(f"a velocity command must be finite, not v={v}, w={w}")
        self._command = Twist2D(v, w)
        self._command_time = self.kit.time

    def wheel_speeds(self, v: float, w: float) -> tuple[float, float]:
        """Return the left and right wheel speeds (rad/s) for a twist.

        If one wheel would be too fast, both are slowed by the same factor: the path keeps its curvature.
        """
        left, right = self._asked_speeds(v, w)
        fastest = max(abs(left), abs(right))
        if not math.isfinite(fastest):
            # A signal that is no number would stop the actuators of all robots.
            largest = max(abs(v), abs(w))
            left, right = self._asked_speeds(v / largest, w / largest)
            scale = self._largest_speed / max(abs(left), abs(right))
            return left * scale, right * scale
        scale = min(1.0, self._largest_speed / fastest) if fastest > 0.0 else 1.0
        return left * scale, right * scale

    def _asked_speeds(self, v: float, w: float) -> tuple[float, float]:
        """Return the left and right wheel speeds (rad/s) for a twist, however fast."""
        left = (v - w * self.track / 2.0) / self.wheel_radius
        right = (v + w * self.track / 2.0) / self.wheel_radius
        return left, right

    def act(self) -> None:
        """Write the wheel speeds to the actuators: zero once the command is too old."""
        expired = self.kit.progress.time - self._command_time > self._timeout - 1e-9
        left, right = (0.0, 0.0) if expired else self.wheel_speeds(self._command.v, self._command.w)
        for one, speed in ((self._left, left), (self._right, right)):
            self.kit.data.ctrl[one.number] = one.control(speed)

    def snapshot(self) -> dict[str, Any]:
        """Return the last command, and whether there was power, as plain data."""
        time = None if math.isinf(self._command_time) else self._command_time
        return {"v": self._command.v, "w": self._command.w, "time": time, "powered": self._powered}

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        """Take over the command of a snapshot, and whether there was power."""
        self._command = Twist2D(float(snapshot["v"]), float(snapshot["w"]))
        self._command_time = -math.inf if snapshot["time"] is None else float(snapshot["time"])
        self._powered = bool(snapshot["powered"])


def _velocity_servo(kit: DeviceKit, wheel: str) -> Servo:
    found = servo(kit, wheel)
    if found.mode is not JointMode.VELOCITY:
        raise SceneError(f"{kit.scene.path}: actuator {wheel!r} must take a velocity, as MJCF's velocity does")
    return found


def _wheel_radius(kit: DeviceKit, wheels: tuple[str, str], joints: list[int]) -> float:
    model = kit.model
    radii = []
    for wheel, joint in zip(wheels, joints, strict=True):
        body = model.jnt_bodyid[joint]
        geoms = range(int(model.body_geomadr[body]), int(model.body_geomadr[body] + model.body_geomnum[body]))
        sizes = [float(model.geom_size[geom][0]) for geom in geoms if int(model.geom_type[geom]) in ROUND]
        if not sizes:
            raise SceneError(f"{kit.scene.path}: the body of joint {wheel!r} has no round geom to be a wheel")
        radii.append(sizes[0])
    if radii[0] != radii[1]:
        raise SceneError(f"{kit.scene.path}: wheels {wheels[0]!r} and {wheels[1]!r} have different radii {radii}")
    return radii[0]


def _left_of_base(kit: DeviceKit, body: int) -> float:
    """Return how far (m) a wheel is to the left of its base, by the file: a detour over the world frame would round."""
    position = np.zeros(3)
    for member in _up_to_base(kit, body):
        mujoco.mju_rotVecQuat(position, position.copy(), kit.model.body_quat[member])
        position += kit.model.body_pos[member]
    return float(position[1])


def _check_axis(kit: DeviceKit, wheel: str, joint: int) -> None:
    """Check that a wheel that turns forward drives its robot forward; raises SceneError."""
    axis = np.array(kit.model.jnt_axis[joint])
    for member in _up_to_base(kit, int(kit.model.jnt_bodyid[joint])):
        mujoco.mju_rotVecQuat(axis, axis.copy(), kit.model.body_quat[member])
    if axis[1] < math.cos(MOST_LEANING):
        found = ", ".join(f"{part:.2f}" for part in (np.round(axis, 2) + 0.0).tolist())
        raise SceneError(
            f"{kit.scene.path}: the axis of joint {wheel!r} must point to the left in the base, along y, not ({found})"
        )


def _up_to_base(kit: DeviceKit, body: int) -> Iterator[int]:
    """Yield a body and those on which it hangs, without the base."""
    while body not in (kit.base, 0):
        yield body
        body = int(kit.model.body_parentid[body])


def _largest_speed(kit: DeviceKit, wheel: Servo) -> float:
    """Return the largest speed (rad/s) that a wheel's control range allows either way."""
    low, high = kit.model.actuator_ctrlrange[wheel.number]
    if not kit.model.actuator_ctrllimited[wheel.number] or not low < 0.0 < high:
        raise SceneError(f"{kit.scene.path}: actuator {wheel.name!r} needs a ctrlrange from below 0 to above it")
    return float(min(-low, high) / abs(wheel.control(1.0)))
