"""A robot for FROG's missions, without a world: each part does what it is told at once, or fails as it is told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from regraft import Cancelled, Component, Parameter, RequestRefused, action, service, stacks
from regraft.bus_schema.messages.geometry import FramedPose, Pose, Vector3
from regraft.bus_schema.messages.health import SensorFault, SensorHealth
from regraft.bus_schema.messages.maps import Frontier, MapFile, NextFrontier, SaveMap
from regraft.bus_schema.messages.navigation import Arrival, NavigateTo, NavigationProgress
from regraft.bus_schema.messages.perception import Detect, Detection, Sightings
from regraft.bus_schema.messages.power import BatteryState, Charge, Charged, ChargeProgress
from regraft.bus_schema.messages.sensors import LightLevel
from regraft.bus_schema.model.adaptation import AdaptationReport, AdaptationRequest, Outcome, Violation
from regraft.testing import Rig

STACKS = Path(stacks.__file__).parent / "frog"
MISSIONS = STACKS / "missions"
NODES = "regraft.stacks.frog.quality:REQUIREMENTS regraft.stacks.frog.plans:PLANS"


def power(rig: Rig, charge: float) -> None:
    """Tell how full the battery is."""
    rig.publish("battery", BatteryState(rig.clock.now() / 1e9, 2000.0 * charge, 2000.0, charge, 7.0))


def darkness(rig: Rig, level: float) -> None:
    """Tell how dark it is."""
    rig.publish("light", LightLevel(rig.clock.now() / 1e9, level))


def sensors(rig: Rig, *faults: str) -> None:
    """Tell what is wrong with the sensors, as 'scan silent'."""
    words = (fault.split() for fault in faults)
    found = tuple(SensorFault(topic, fault, "as it is", 0.0) for topic, fault in words)
    rig.publish("sensor_health", SensorHealth(rig.clock.now() / 1e9, ("scan", "odometry"), found))


class Navigator(Component):
    """Arrives after a while, unless the goal's x is among those that cannot be reached."""

    seconds = Parameter(5.0, "how long a drive takes", unit="s")
    max_velocity = Parameter(0.26, "how fast it may be", unit="m/s")

    def __init__(self) -> None:
        self.blocked: set[float] = set()
        self.reached: list[float] = []
        self.cancelled: list[float] = []

    @action("navigate_to", feedback=NavigationProgress)
    async def navigate_to(self, goal: NavigateTo) -> Arrival:
        """Drive."""
        x = goal.goal.pose.x
        try:
            await self.kit.sleep(self.seconds)
        except Cancelled:
            self.cancelled.append(x)
            raise
        if x in self.blocked:
            return Arrival(False, Pose(), "the way is blocked")
        self.reached.append(x)
        return Arrival(True, goal.goal.pose)


class Explorer(Component):
    """Gives frontiers at x = 1, 2, ... until there are no more."""

    count = Parameter(3, "how many there are")

    def __init__(self) -> None:
        self.asked: list[bool] = []
        self.failures = 0

    @service("next_frontier")
    def next_frontier(self, request: NextFrontier) -> Frontier:
        """Give the next one."""
        if self.failures:
            self.failures -= 1
            raise RequestRefused("no map has come")
        self.asked.append(request.unreached)
        given = len(self.asked)
        if given > self.count:
            return Frontier(False, 0)
        goal = FramedPose("map", Pose.planar(float(given), 0.0, 0.0))
        return Frontier(True, self.count - given + 1, goal, 1.0, 2.0)


class Docking(Component):
    """Fills the battery after a while, unless told to fail."""

    def __init__(self) -> None:
        self.until: list[float] = []
        self.failures = 0
        self.cancelled = 0

    @action("charge", feedback=ChargeProgress)
    async def charge(self, goal: Charge) -> Charged:
        """Charge."""
        self.until.append(goal.until)
        self.kit.feedback(ChargeProgress(0.5, "driving", 10.0))
        try:
            await self.kit.sleep(10.0)
        except Cancelled:
            self.cancelled += 1
            raise
        if self.failures:
            self.failures -= 1
            return Charged(False, 0.5, "no charger felt")
        return Charged(True, goal.until)


class Detector(Component):
    """Sees the hydrant whenever the robot last got to one of some places."""

    pictures = Parameter(1, "pictures for a request that does not say how many")
    interval = Parameter(1.0, "the pause before each, which it does not take", unit="s")

    def __init__(self) -> None:
        self.navigator: Navigator | None = None
        self.seen_from: set[float] = set()
        self.spread = 0.01
        self.broken = False
        self.failures = 0
        self.is_on_board: Callable[[], bool] = lambda: True
        self.asked: list[int] = []

    @service("detect")
    async def detect(self, request: Detect) -> Sightings:
        """Look."""
        pictures = request.pictures or self.pictures
        self.asked.append(pictures)
        if self.failures:
            self.failures -= 1
            raise RequestRefused("no picture came")
        await self.kit.sleep(0.2 * pictures)
        seen = Sightings(pictures, 0, paid=pictures if self.is_on_board() else 0, picture_energy=59.275)
        if self.broken:
            return replace(seen, useful=0)
        reached = self.navigator.reached if self.navigator else []
        if not self.seen_from.intersection(reached[-1:]):
            return seen
        best = Detection("hydrant", 0.9, "map", Vector3(1.1, 2.0, 0.0), 0.1, 1.0)
        found = replace(seen, hits=pictures, best=best, useful=pictures)
        return replace(found, position=Vector3(1.0, 2.0, 0.0), frame="map", spread=self.spread)


class Mapper(Component):
    """Writes no map, but says so."""

    @service("save_map")
    def save_map(self, request: SaveMap) -> MapFile:
        """Keep the map."""
        return MapFile(f"/maps/{request.file}.yaml", 20.0)


class Manager(Component):
    """Applies whatever is asked for, unless told to refuse."""

    def __init__(self) -> None:
        self.asked: list[AdaptationRequest] = []
        self.refuse = ""

    @service("adaptation_manager/adapt")
    async def adapt(self, request: AdaptationRequest) -> AdaptationReport:
        """Take the request."""
        self.asked.append(request)
        await self.kit.sleep(0.5)
        if self.refuse:
            why = (Violation(0, "detector", "component", self.refuse),)
            return AdaptationReport("1", Outcome.REJECTED, request, 1, 1, 0.0, violations=why)
        return AdaptationReport("1", Outcome.APPLIED, request, 1, 2, 0.0)
