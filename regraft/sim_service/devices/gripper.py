"""A parallel gripper."""

from collections.abc import Mapping
from typing import Any

from regraft import Input, Output, Parameter
from regraft.bus_schema.messages.devices.joints import GripperCommand, GripperState, JointMode
from regraft.sim_service.contacts import bodies_around
from regraft.sim_service.devices.core.failure_schedule import BIAS, NOISE
from regraft.sim_service.devices.core.sensor import Sensor, failure_parameter
from regraft.sim_service.devices.servo import servo, slide
from regraft.sim_service.layout.scene import SceneError


class ParallelGripper(Sensor):
    """Two fingers on slides whose positions grow as they open, moved by position actuators.

    The width is the sum of both positions and ``closed_width``. One actuator suffices where an MJCF equality couples
    the fingers. Each finger presses with half of what all actuators give together. The gripper holds a thing while
    both fingers touch the same body of another robot or of the world. A geom of the worldbody is a thing, too; floors
    are none. The gripper then presses with the force that it was commanded, as far as the actuators' control ranges
    allow. The default of 4 N held blocks of 12 and 50 g for 10 s. The pads had friction 1; forces from 1 to 20 N did
    as well. The noise is an assumption.
    """

    measures = "gripper_state"

    gripper_command = Input(GripperCommand, description="how far the fingers shall be apart", required=False)
    gripper_state = Output(GripperState, description="how far the fingers are apart, and whether they hold a thing")

    fingers = Parameter("left_finger right_finger", "the two MJCF joints, with a space between", read_only=True)
    actuators = Parameter("grip", "the MJCF actuators, with spaces between", read_only=True)
    closed_width = Parameter(0.0, "width at joint positions of zero", unit="m", read_only=True)
    force = Parameter(4.0, "largest force of a finger", minimum=0.0, unit="N", read_only=True)
    width_noise = Parameter(1e-4, "standard deviation of the width", minimum=0.0, unit="m", read_only=True)
    force_noise = Parameter(0.05, "standard deviation of the force", minimum=0.0, unit="N", read_only=True)
    failure = failure_parameter(BIAS, NOISE)
    bias = Parameter(0.005, "what a bias adds to the width", unit="m")
    more_noise = Parameter(0.005, "standard deviation that the failure noise adds to the width", minimum=0.0, unit="m")

    def build(self) -> None:
        """Find fingers and actuators, and hold the fingers where they are; raises SceneError."""
        kit = self.kit
        names = self.fingers.split()
        if len(names) != 2:
            raise SceneError(f"{kit.name}: the parameter 'fingers' must name two MJCF joints, not {self.fingers!r}")
        self._slides = [slide(kit, name) for name in names]
        self._servos = [servo(kit, name) for name in self.actuators.split()]
        if not self._servos or any(one.mode is not JointMode.POSITION for one in self._servos):
            raise SceneError(f"{kit.name}: the parameter 'actuators' must name position actuators of the fingers")
        bodies = [int(kit.model.jnt_bodyid[kit.index("joint", name)]) for name in names]
        self._pads = [frozenset(kit.scene.geoms_of(body)) for body in bodies]
        self._things = bodies_around(kit.scene, kit.scene.geoms_of(kit.base))
        self._width, self._force = self.width(), self.force
        self._holding = False
        for one in self._servos:
            kit.model.actuator_forcelimited[one.number] = True

    @gripper_command.handler
    def on_command(self, command: GripperCommand) -> None:
        """Bring the fingers to a width, with a force that is limited; raises ValueError if the width is none."""
        for one in self._servos:
            one.check((command.width - self.closed_width) / 2.0)
        self._width = command.width
        self._force = self.force if command.force is None else min(command.force, self.force)

    def width(self) -> float:
        """Return how far (m) the fingers really are apart."""
        return self.closed_width + sum(float(self.kit.data.qpos[position]) for position, _ in self._slides)

    def closing_force(self) -> float:
        """Return the force (N) with which each finger really is driven; negative as they open."""
        return -sum(float(self.kit.data.qfrc_actuator[velocity]) for _, velocity in self._slides) / 2.0

    def act(self) -> None:
        """Write the finger positions and the limits of the force."""
        target = (self._width - self.closed_width) / 2.0
        for one in self._servos:
            share = 2.0 * self._force / len(self._servos)
            limit = share / abs(one.gear)
            self.kit.model.actuator_forcerange[one.number] = (-limit, limit)
            # A thing in the grip keeps the fingers from their target: the limit then is what they press with.
            press = share / (one.gear**2 * one.back) if self._holding and self._width < self.width() else 0.0
            self.kit.data.ctrl[one.number] = one.control(target - press)

    def watch(self) -> None:
        """Look whether both fingers touch one thing."""
        touched: tuple[set[str], set[str]] = (set(), set())
        for one, other in self.kit.data.contact.geom.tolist():
            for pads, things in zip(self._pads, touched, strict=True):
                if one in pads and other in self._things:
                    things.add(self._things[other])
                elif other in pads and one in self._things:
                    things.add(self._things[one])
        self._holding = bool(touched[0] & touched[1])

    def measure(self) -> GripperState:
        """Return the state with its noise, spoiled by what fails."""
        kit = self.kit
        errors = kit.random(kit.name, kit.progress.tick).standard_normal(3).tolist()
        width = self.width() + self.width_noise * errors[0]
        if kit.failing == BIAS:
            width += self.bias
        if kit.failing == NOISE:
            width += self.more_noise * errors[2]
        return GripperState(kit.stamp, width, self.closing_force() + self.force_noise * errors[1], self._holding)

    def snapshot(self) -> dict[str, Any]:
        """Return the command, whether something is held, and the last message."""
        own = {"width": self._width, "force": self._force, "holding": self._holding}
        return {**super().snapshot(), **own}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take over the command, whether something is held, and the last message."""
        super().restore(state)
        self._width, self._force = float(state["width"]), float(state["force"])
        self._holding = bool(state["holding"])
