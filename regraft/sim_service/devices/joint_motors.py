"""Motors of joints, with encoders."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from regraft import Input, Output, Parameter
from regraft.bus_schema.messages.devices.joints import JointCommand, JointMode, JointState, JointStates
from regraft.sim_service.devices.core.failure_schedule import BIAS, NOISE
from regraft.sim_service.devices.core.sensor import Sensor, failure_parameter
from regraft.sim_service.devices.servo import servo
from regraft.sim_service.layout.scene import SceneError


class JointMotors(Sensor):
    """Moves joints as commanded, and measures how they are.

    The MJCF defines what an actuator is commanded in: ``position``, ``velocity`` or ``motor`` (torque). Positions hold
    until the next command, at first those of the start; velocities and torques end after ``timeout``. Positions come in
    the steps of an encoder: 4096 a turn, as in a Dynamixel XM430-W350 (ROBOTIS e-Manual). The noise of velocities and
    torques is an assumption.
    """

    measures = "joint_states"

    joint_command = Input(JointCommand, description="what the joints shall do", required=False)
    joint_states = Output(JointStates, description="positions, velocities and torques of the joints")

    actuators = Parameter("", "the MJCF actuators, with spaces between", read_only=True)
    timeout = Parameter(0.5, "how long a velocity or a torque holds", minimum=0.0, unit="s", read_only=True)
    resolution = Parameter(
        2.0 * math.pi / 4096, "step of a measured position; 0: none", minimum=0.0, unit="rad or m", read_only=True
    )
    velocity_noise = Parameter(
        0.01, "standard deviation of a velocity", minimum=0.0, unit="rad/s or m/s", read_only=True
    )
    torque_noise = Parameter(0.01, "standard deviation of a torque", minimum=0.0, unit="N m or N", read_only=True)
    failure = failure_parameter(BIAS, NOISE)
    bias = Parameter(0.1, "what a bias adds to each position", unit="rad or m")
    more_noise = Parameter(
        0.1, "standard deviation that the failure noise adds to a position", minimum=0.0, unit="rad or m"
    )

    def build(self) -> None:
        """Find the actuators and hold the joints where they are; raises SceneError."""
        names = self.actuators.split()
        if not names:
            raise SceneError(f"{self.kit.name}: the parameter 'actuators' must name at least one MJCF actuator")
        self._servos = {name: servo(self.kit, name) for name in names}
        self._names = tuple(self._servos)
        self._positions = [one.position for one in self._servos.values()]
        self._velocities = [one.velocity for one in self._servos.values()]
        self._targets = {
            name: float(self.kit.data.qpos[one.position]) if one.mode is JointMode.POSITION else 0.0
            for name, one in self._servos.items()
        }
        self._since = dict.fromkeys(self._servos, 0.0)
        """When (s) each joint was commanded last."""

    @joint_command.handler
    def on_command(self, command: JointCommand) -> None:
        """Move like this; raises ValueError if a joint is unknown or cannot be commanded so: then none is."""
        for name, value in command.values.items():
            one = self._servos.get(name)
            if one is None:
                raise ValueError(f"{self.kit.name} has no joint {name!r}; it has: {', '.join(self._servos)}")
            if one.mode is not command.mode:
                raise ValueError(f"the joint {name!r} takes commands of {one.mode.value}, not of {command.mode.value}")
            one.check(value)
        self._targets |= command.values
        self._since |= dict.fromkeys(command.values, self.kit.time)

    def act(self) -> None:
        """Write the control signals; MuJoCo limits them to the actuators' ranges."""
        oldest = self.kit.time - self.timeout + 1e-9
        for name, one in self._servos.items():
            expired = one.mode is not JointMode.POSITION and self._since[name] < oldest
            self.kit.data.ctrl[one.number] = 0.0 if expired else one.control(self._targets[name])

    def measure(self) -> JointStates:
        """Return the state of the joints with its noise, spoiled by what fails."""
        kit, count = self.kit, len(self._names)
        errors = kit.random(kit.name, kit.progress.tick).standard_normal((3, count))
        positions = kit.data.qpos[self._positions].copy()
        if self.resolution > 0.0:
            positions = np.round(positions / self.resolution) * self.resolution
        if kit.failing == BIAS:
            positions += self.bias
        if kit.failing == NOISE:
            positions += self.more_noise * errors[2]
        velocities = kit.data.qvel[self._velocities] + self.velocity_noise * errors[0]
        torques = kit.data.qfrc_actuator[self._velocities] + self.torque_noise * errors[1]
        values = np.stack([positions, velocities, torques], axis=1).tolist()
        return JointStates(kit.stamp, {n: JointState(*state) for n, state in zip(self._names, values, strict=True)})

    def snapshot(self) -> dict[str, Any]:
        """Return the commands and the last message."""
        return {**super().snapshot(), "targets": dict(self._targets), "since": dict(self._since)}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take over the commands and the last message."""
        super().restore(state)
        self._targets = {str(name): float(value) for name, value in state["targets"].items()}
        self._since = {str(name): float(time) for name, time in state["since"].items()}
