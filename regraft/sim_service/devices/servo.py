"""An actuator of a joint, as its MJCF makes it: what it is commanded in, and how a command reaches it."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco

from regraft.bus_schema.messages.devices.joints import JointMode
from regraft.sim_service.devices.core.device_kit import DeviceKit
from regraft.sim_service.layout.scene import SceneError

FOLLOWING = (mujoco.mjtDyn.mjDYN_NONE, mujoco.mjtDyn.mjDYN_FILTER, mujoco.mjtDyn.mjDYN_FILTEREXACT)
"""Dynamics by which the force comes to follow the signal."""


@dataclass(frozen=True, slots=True)
class Servo:
    """An actuator, the addresses of its joint's position (qpos) and velocity (qvel), and its law.

    Before the gear its force (N m, N) is ``gain`` times the signal. A servo of positions takes ``back`` times the
    position from that, one of velocities ``back`` times the velocity. It rests where both are equal.
    """

    name: str
    number: int
    position: int
    velocity: int
    mode: JointMode
    gear: float
    gain: float
    back: float

    def control(self, value: float) -> float:
        """Return the control signal for a command in the joint's unit (rad, m, and so on)."""
        if self.mode is JointMode.TORQUE:
            return value / (self.gear * self.gain)
        signal = value * self.gear
        # MJCF's own servos have equal factors: their signals are not to be rounded.
        return signal if self.back == self.gain else signal * self.back / self.gain

    def check(self, value: float) -> None:
        """Raise ValueError if MuJoCo would not take the signal: it then stops the actuators of all robots."""
        signal = self.control(value)
        if not abs(signal) <= mujoco.mjMAXVAL:
            raise ValueError(f"{value:g} for {self.name!r} is a signal of {signal:g}, beyond {mujoco.mjMAXVAL:g}")


def servo(kit: DeviceKit, name: str) -> Servo:
    """Return the named actuator of a robot's hinge or slide; raises SceneError.

    MJCF's ``motor`` takes torques, ``position`` positions, ``velocity`` velocities: their bias terms differ. A
    ``general`` actuator of one of these kinds may have a unit of its own for its signal.
    """
    model, number = kit.model, kit.index("actuator", name)
    joint = int(model.actuator_trnid[number][0])
    turns = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
    moves_joint = int(model.actuator_trntype[number]) == int(mujoco.mjtTrn.mjTRN_JOINT)
    if not moves_joint or int(model.jnt_type[joint]) not in turns:
        raise SceneError(f"{kit.scene.path}: actuator {name!r} must move a hinge or a slide")
    mode, back = _law(kit, name, number)
    gear, gain = float(model.actuator_gear[number][0]), float(model.actuator_gainprm[number][0])
    if gear == 0.0 or gain == 0.0:
        raise SceneError(f"{kit.scene.path}: actuator {name!r} must have a gear and a gain other than 0")
    addresses = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
    return Servo(name, number, *addresses, mode, gear, gain, back)


def _law(kit: DeviceKit, name: str, number: int) -> tuple[JointMode, float]:
    """Return what an actuator takes, and the factor of what it takes back; raises SceneError."""
    model = kit.model
    bias, dynamics = int(model.actuator_biastype[number]), int(model.actuator_dyntype[number])
    affine = bias == int(mujoco.mjtBias.mjBIAS_AFFINE)
    offset, stiffness, damping = (float(value) if affine else 0.0 for value in model.actuator_biasprm[number][:3])
    if (
        offset
        or not (affine or bias == int(mujoco.mjtBias.mjBIAS_NONE))
        or int(model.actuator_gaintype[number]) != int(mujoco.mjtGain.mjGAIN_FIXED)
        or dynamics not in (int(dyn) for dyn in FOLLOWING)
    ):
        raise SceneError(
            f"{kit.scene.path}: actuator {name!r} must take a position, a velocity or a torque, "
            "as MJCF's position, velocity and motor do"
        )
    if stiffness:
        return JointMode.POSITION, -stiffness
    return (JointMode.VELOCITY, -damping) if damping else (JointMode.TORQUE, 0.0)


def slide(kit: DeviceKit, name: str) -> tuple[int, int]:
    """Return the addresses of a named slide's position (qpos) and velocity (qvel); raises SceneError."""
    model, joint = kit.model, kit.index("joint", name)
    if int(model.jnt_type[joint]) != int(mujoco.mjtJoint.mjJNT_SLIDE):
        raise SceneError(f"{kit.scene.path}: joint {name!r} must be a slide")
    return int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
