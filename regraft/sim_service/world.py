"""A simulated world with its robots, as the source of simulated time."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from regraft import Input, Output, Parameter, Quality, Records
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.geometry import Pose, Twist
from regraft.bus_schema.messages.sensors import LightLevel
from regraft.bus_schema.messages.world import GeomColour, GroundTruth, WorldState
from regraft.bus_schema.model.description import Resources
from regraft.component.quality import PartlyMeasured
from regraft.lockstep.source import TimeSource
from regraft.planar import Pose2D, Twist2D
from regraft.sim_service.devices.core.calling import Calls
from regraft.sim_service.devices.core.device_kit import DeviceParameters
from regraft.sim_service.devices.core.failure_schedule import DeviceFails
from regraft.sim_service.devices.core.fitting import Fitted, parameters_of, ports_of, qualities_of
from regraft.sim_service.layout.identity import world_hash
from regraft.sim_service.people.crowds import CROWD, Crowding, CrowdParameter, changes, check_crowds, present_groups
from regraft.sim_service.people.walkers import Person
from regraft.sim_service.robots import RobotSpec
from regraft.sim_service.rooms.loading import load_world
from regraft.sim_service.simulated_robot import SimulatedRobot
from regraft.sim_service.simulation import Simulation, SimulationSettings
from regraft.sim_service.stability import UnstablePhysics
from regraft.sim_service.trial import try_world
from regraft.sim_service.wiring import DeviceWiring, check_failures

MAP_FRAME = "map"
TRUTH = "ground_truth"


class World(TimeSource):
    """A MuJoCo world with its robots, whose devices take commands and publish what they sense.

    Where things stand is drawn from the run's seed. Each robot brings the parameters and ports of its devices, under
    its name: see `Device`. Cameras are components of their own, fed by ``world_state``.

    The parameters ``..._failure`` make devices fail at once. The schedule ``failures`` makes them fail by the clock,
    while the parameter is none.

    People of a group come and go by the schedule ``crowds``. The parameter ``crowd`` names groups that are present at
    any time.
    """

    state_version = 4
    resources = Resources(cpu=0.1, memory=65.0)

    file = Parameter("", "the world's MJCF file", unit="path", exists=True, read_only=True)
    control_period = Parameter(
        SimulationSettings().control_period,
        "how often commands reach the actuators, people move and contacts are looked for; whole physics steps",
        minimum=0.0005,
        maximum=0.1,
        unit="s",
        read_only=True,
    )
    robots = Records(RobotSpec, "the robots in it, with their devices")
    people = Records(Person, "who walks to and fro in it")
    crowds = Records(Crowding, "when which group of people comes or goes", in_order_of="at")
    failures = Records(DeviceFails, "when which device fails", in_order_of="at")

    light = Input(LightLevel, required=False, description="how far the lamps are dimmed")
    world_state = Output(WorldState, description="what a camera needs to draw a tick, if there is one")

    @classmethod
    def parameters_for(cls, parameters: dict[str, Any]) -> Iterable[Parameter[Any]]:
        """Name the groups that are present, and the parameters of all devices of all robots.

        Raises:
            ParameterError: a device that is to fail, or a group that is to come, does not exist.
        """
        check_failures(parameters["robots"], parameters["failures"])
        check_crowds(parameters["people"], parameters["crowds"])
        yield CrowdParameter(parameters["people"])
        yield from parameters_of(parameters["robots"])

    @classmethod
    def ports_for(cls, parameters: dict[str, Any]) -> Iterable[Input[Any] | Output[Any]]:
        """Name the ports of all devices of all robots, and an output for the truth about each robot."""
        robots: tuple[RobotSpec, ...] = parameters["robots"]
        yield from ports_of(robots, cls.on_command.__name__)
        for robot in robots:
            topic = robot.prefix + TRUTH
            what = "what really is, every tick; for evaluation and tests only"
            yield Output(GroundTruth, topic=topic, name=topic, required=False, description=what)

    @classmethod
    def qualities_for(cls, parameters: dict[str, Any]) -> Iterable[Quality]:
        """Name the contacts of all robots together and of each, and the qualities of their devices."""
        contacts = Quality("how often robots have touched something", better="lower", minimum=0.0, estimated=False)
        robots: tuple[RobotSpec, ...] = parameters["robots"]
        for name in dict.fromkeys(("contacts", *(f"{robot.prefix}contacts" for robot in robots))):
            yield contacts.renamed(name)
        yield from qualities_of(robots)

    @classmethod
    def check_parameters(cls, parameters: dict[str, Any], seed: int) -> None:
        """Load the world, place everything, and let a moment pass, all with the world's values for its devices."""

        def given(device: Fitted) -> DeviceParameters:
            shorts = device.declared.parameters
            return DeviceParameters({short: parameters[device.parameter(short)] for short in shorts})

        scene = load_world(_named(parameters["file"]), parameters["robots"], seed)
        try_world(scene, seed, _settings(parameters), given)

    def on_configure(self) -> None:
        """Load the world and place everything; raises SceneError, PlacementError, DeviceError."""
        scene = load_world(_named(self.file), self.robots, self.kit.seed)
        self._wiring = DeviceWiring(self.kit, self.robots, self.failures)
        settings = _settings(self.kit.parameters.values)
        self.simulation = Simulation(scene, self.kit.seed, settings, parameters=self._wiring.parameters)
        self._contacts = dict.fromkeys(self.simulation.robots, 0)
        self._learn_the_world()

    def _learn_the_world(self) -> None:
        self._hash = world_hash(self.simulation.scene, self.simulation.placement)
        self._wiring.connect(self.simulation)

    def on_command(self, port: str, message: object) -> None:
        """Have devices handle a message."""
        self._wiring.handle(port, message)

    @light.handler
    def on_light(self, level: LightLevel) -> None:
        """Dim the lamps."""
        self.simulation.set_light(1.0 - level.darkness)

    @property
    def ticks(self) -> int:
        """World ticks since the start of the run; a restarted world continues to count."""
        return round(self.simulation.time * self.tick_rate)

    def advance(self, tick: int, seconds: float) -> None:
        """Advance the world by ``seconds`` and publish what its devices sense; unstable physics is a failure.

        A device that raises is reported at the end: all others sense, and physics keeps to the clock.
        """
        now = self.kit.now()
        self.simulation.progress.stamp = now
        self._wiring.fail(now)
        self._crowd(now)
        calls = Calls()
        try:
            self.simulation.advance(seconds, calls)
        except UnstablePhysics as error:
            self.kit.event("world.unstable", str(error), robot=error.robot, element=error.element)
            self.kit.fail(str(error))
        else:
            self._sense(now, calls)
        calls.raise_all()

    def _sense(self, now: float, calls: Calls) -> None:
        for robot in self.simulation.robots.values():
            self._note_contacts(robot)
            for device in robot.devices.values():
                calls.call(device, device.sense)
        truths = [self._publish_truth(now, robot) for robot in self.simulation.robots.values()]
        if self.world_state.wanted:
            self._publish_state(now, truths[0].pose if truths else Pose.planar(0.0, 0.0, 0.0), calls)

    def _crowd(self, now: float) -> None:
        """Have groups of people come and go."""
        present = present_groups(self.crowds, self.kit.parameters.values[CROWD], now)
        for group, comes in changes(self.simulation.present, present):
            self.simulation.set_present(group, comes)
            text = f"the people of {group} {'come' if comes else 'go'}"
            self.kit.event("world.crowd", text, group=group, present=comes)

    def _note_contacts(self, robot: SimulatedRobot) -> None:
        name = robot.spec.name
        for contact in robot.contacts.take_events():
            self._contacts[name] += 1
            whose = f"the robot {name}" if name else "the robot"
            self.kit.event("world.contact", f"{whose} touches {contact.body}", robot=name, body=contact.body)

    def _publish_truth(self, now: float, robot: SimulatedRobot) -> GroundTruth:
        time = self.simulation.time
        truth = robot.truth(time)
        touching = tuple(sorted(robot.contacts.touching(time)))
        count = self._contacts[robot.spec.name]
        message = GroundTruth(now, self.ticks, _pose(truth.pose), _twist(truth.twist), touching, count)
        self.kit.outputs[robot.spec.prefix + TRUTH].publish_deferred(lambda: message)
        return message

    def _publish_state(self, now: float, base: Pose, calls: Calls) -> None:
        state = self.simulation.render_state(calls)
        colours = tuple(GeomColour(geom, *colour) for geom, colour in state.colours.items())
        told = WorldState(now, self.ticks, self.simulation.seed, self._hash, state.qpos, state.light, base, colours)
        self.world_state.publish_deferred(lambda: told)

    def evaluate(self) -> dict[str, float]:
        """Return how often the robots have touched something, as ``contacts``, and what their devices give.

        The contacts of one robot among several are under its name too, such as ``rescuer/contacts``.

        Raises:
            PartlyMeasured: a device raised an exception; it has the values of all others.
        """
        qualities = {"contacts": float(sum(self._contacts.values()))}
        for robot in self.simulation.robots.values():
            qualities[f"{robot.spec.prefix}contacts"] = float(self._contacts[robot.spec.name])
        given, errors = self._wiring.evaluate()
        qualities |= given
        if errors:
            raise PartlyMeasured(qualities, errors)
        return qualities

    def snapshot(self) -> PlainValue:
        """Return the whole state of the simulation, and what has been reported of it."""
        return {
            "simulation": self.simulation.snapshot(),
            "contacts": dict(self._contacts),
            "failing": self._wiring.snapshot(),
        }

    def restore(self, state: PlainValue) -> None:
        """Continue from a snapshot; raises SnapshotError if it was taken in another world."""
        self.simulation.restore(state["simulation"])
        self._contacts = {str(name): int(count) for name, count in state["contacts"].items()}
        self._wiring.restore(state["failing"])
        self._learn_the_world()


def _pose(pose: Pose2D) -> Pose:
    return Pose.planar(pose.x, pose.y, pose.yaw)


def _twist(twist: Twist2D) -> Twist:
    return Twist.planar(twist.v, twist.w)


def _named(file: str) -> str:
    if not file:
        raise ValueError("the parameter 'file' must name the world's MJCF file")
    return file


def _settings(parameters: Mapping[str, Any]) -> SimulationSettings:
    tick = 1.0 / parameters["tick_rate"]
    return SimulationSettings(
        tick=tick,
        control_period=min(tick, parameters["control_period"]),
        people=parameters["people"],
    )
