"""An actuator of a joint, as its MJCF makes it: what it is commanded in, and how a command reaches it."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco

from regraft.bus_schema.messages.devices.joints import JointMode
from regraft.sim_service.devices.core.device_kit import DeviceKit
from regraft.sim_service.layout.scene import SceneError


@dataclass(frozen=True, slots=True)
class Servo:
    """An actuator, the addresses of its joint's position (qpos) and velocity (qvel), and its law.

    ``gain`` is the force (N m, N) at the joint's side of the gear per unit of control.
    """

    name: str
    number: int
    position: int
    velocity: int
    mode: JointMode
    gear: float
    gain: float

    def control(self, value: float) -> float:
        """Return the control signal for a command in the joint's unit (rad, m, and so on)."""
        return value / (self.gear * self.gain) if self.mode is JointMode.TORQUE else value * self.gear

    def check(self, value: float) -> None:
        """Raise ValueError if MuJoCo would not take the signal: it then stops the actuators of all robots."""
        signal = self.control(value)
        if not abs(signal) <= mujoco.mjMAXVAL:
            raise ValueError(f"{value:g} for {self.name!r} is a signal of {signal:g}, beyond {mujoco.mjMAXVAL:g}")


def servo(kit: DeviceKit, name: str) -> Servo:
    """Return the named actuator of a robot's hinge or slide; raises SceneError.

    MJCF's ``motor`` takes torques, ``position`` positions, ``velocity`` velocities: their bias terms differ.
    """
    model, number = kit.model, kit.index("actuator", name)
    joint = int(model.actuator_trnid[number][0])
    turns = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
    moves_joint = int(model.actuator_trntype[number]) == int(mujoco.mjtTrn.mjTRN_JOINT)
    if not moves_joint or int(model.jnt_type[joint]) not in turns:
        raise SceneError(f"{kit.scene.path}: actuator {name!r} must move a hinge or a slide")
    _, stiffness, damping = (float(value) for value in model.actuator_biasprm[number][:3])
    mode = JointMode.POSITION if stiffness else JointMode.VELOCITY if damping else JointMode.TORQUE
    gear, gain = float(model.actuator_gear[number][0]), float(model.actuator_gainprm[number][0])
    if gear == 0.0 or gain == 0.0:
        raise SceneError(f"{kit.scene.path}: actuator {name!r} must have a gear and a gain other than 0")
    addresses = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
    return Servo(name, number, *addresses, mode, gear, gain)


def slide(kit: DeviceKit, name: str) -> tuple[int, int]:
    """Return the addresses of a named slide's position (qpos) and velocity (qvel); raises SceneError."""
    model, joint = kit.model, kit.index("joint", name)
    if int(model.jnt_type[joint]) != int(mujoco.mjtJoint.mjJNT_SLIDE):
        raise SceneError(f"{kit.scene.path}: joint {name!r} must be a slide")
    return int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
