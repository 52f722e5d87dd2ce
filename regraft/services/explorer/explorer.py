"""The explorer: the service ``next_frontier`` as a component."""

from __future__ import annotations

import math
from dataclasses import dataclass

from regraft import Component, Input, Parameter, Quality, RefusalCode, RequestRefused, service
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages import geometry, maps, sensors
from regraft.bus_schema.messages.health import Level
from regraft.bus_schema.model.description import Resources
from regraft.services import robot_parameters
from regraft.services.explorer.forecast import forecast
from regraft.services.explorer.frontiers import Frontier, FrontierSettings, find_frontiers
from regraft.services.explorer.ground import Ground
from regraft.services.explorer.places import Places
from regraft.services.explorer.strategies import STRATEGIES, Weights, choose
from regraft.services.navigator.conversions import grid_of, planar_pose

LOOK_INTERVAL = 0.1
THERE = 0.3
"""m: nearer to the last goal than this, the robot has looked at what it was given to look at."""


@dataclass(frozen=True, slots=True)
class _Look:
    """The map of one moment: the ground, and the frontiers that may be given."""

    ground: Ground
    frontiers: list[Frontier]


class Explorer(Component):
    """Reports where a robot must go to see more of the room: to the frontiers of known ground.

    Some frontiers stay although the robot has looked at them from several places; others it did not reach. Neither is
    given again until the map around it has changed. So exploring ends in every room that walls close.
    """

    state_version = 1
    checkpoint_every = 5.0
    resources = Resources(cpu=0.02, memory=25.0)
    handler_timeout = 3.0  # it looks at the whole map at once, which may be large

    strategy = Parameter(
        "best", "which frontier comes first: see the weights, or the furthest", choices=tuple(STRATEGIES)
    )
    gain_weight = Parameter(1.0, "what a metre of frontier is worth to the best strategy", minimum=0.0)
    distance_weight = Parameter(1.0, "what a metre of way costs the best strategy", minimum=0.0)
    min_length = Parameter(0.20, "what is shorter is no frontier", minimum=0.0, unit="m")
    min_area = Parameter(0.03, "unknown pockets smaller than this are noise", minimum=0.0, unit="m2")
    radius = robot_parameters.radius()
    turning_room = robot_parameters.turning_room()
    range_max = robot_parameters.range_max()
    renewal = Parameter(0.02, "how much must change on the map for another try", minimum=0.0025, unit="m2")
    ready_within = Parameter(5.0, "how long a request waits for the first map and odometry", minimum=0.0, unit="s")
    map_within = Parameter(2.0, "how long a request waits for what was just seen to be mapped", minimum=0.0, unit="s")

    distance = Quality("to drive to all frontiers that were given", unit="m", better="lower", minimum=0.0)
    requests = Quality("for a frontier", better="lower", minimum=0.0)
    known_area = Quality(
        "at the last request", unit="m2", better="higher", minimum=0.0, functional=True, estimated=False
    )
    frontiers_left = Quality("at the last request", better="lower", minimum=0.0, functional=True, estimated=False)

    map = Input(maps.OccupancyGrid, latest_only=True, description="what is known so far")
    odometry = Input(sensors.Odometry, latest_only=True, description="where the robot is in the map")

    def on_configure(self) -> None:
        """Begin with nothing given."""
        self._places = Places(self.renewal)
        self._seen: _Look | None = None
        self._known: tuple[maps.OccupancyGrid, sensors.Odometry, float, Ground] | None = None
        self._requests = 0
        self._distance = 0.0

    def on_parameters(self, changed: frozenset[str]) -> None:
        """Take over what changed."""
        if hasattr(self, "_places"):
            self._places.renewal = self.renewal

    @service("next_frontier")
    async def next_frontier(self, request: maps.NextFrontier) -> maps.Frontier:
        """Report where to look next, or that nothing is left."""
        asked_at = self.kit.now()
        await self._get_ready()
        if request.unreached:
            self._places.spend(self._ground(), unreached=True)
        elif self._is_there():
            if self._places.still_there(self._look().frontiers):
                await self._see_map_of(asked_at)
            self._places.spend(self._ground())
        look = self._look()
        if not look.frontiers:
            await self._see_map_of(asked_at)
            look = self._look()
        return self._answer(look)

    def _answer(self, look: _Look) -> maps.Frontier:
        left = len(look.frontiers)
        self._requests += 1
        if not look.frontiers:
            self.kit.set_status_text("nothing is left to explore")
            return maps.Frontier(found=False, left=0)
        weights = Weights(self.gain_weight, self.distance_weight)
        chosen = choose(look.frontiers, self.strategy, weights)
        self._places.give(chosen, look.ground)
        self._distance += chosen.distance
        self.kit.set_status_text(f"{left} frontiers, next the one at ({chosen.target[0]:.2f}, {chosen.target[1]:.2f})")
        latest = self.map.latest
        assert latest is not None
        pose = geometry.Pose.planar(chosen.goal.x, chosen.goal.y, chosen.goal.yaw)
        return maps.Frontier(True, left, geometry.FramedPose(latest.frame, pose), chosen.length, chosen.distance)

    async def _get_ready(self) -> None:
        """Wait for what is needed; raises RequestRefused if it does not come."""
        deadline = self.kit.now() + self.ready_within
        while self.map.latest is None or self.odometry.latest is None:
            if self.kit.now() >= deadline:
                missing = "map" if self.map.latest is None else "odometry"
                why = f"cannot look for frontiers: no {missing} has come within {self.ready_within:g} s"
                raise RequestRefused(why, RefusalCode.UNAVAILABLE)
            await self.kit.sleep(LOOK_INTERVAL)

    async def _see_map_of(self, stamp: float) -> None:
        """Wait for a map at least as new as ``stamp``; none comes if there is nothing new to map."""
        deadline = stamp + self.map_within
        while self._map_stamp() < stamp and self.kit.now() < deadline:
            await self.kit.sleep(LOOK_INTERVAL)

    def _map_stamp(self) -> float:
        latest = self.map.latest
        return math.inf if latest is None else latest.stamp

    def _is_there(self) -> bool:
        last, odometry = self._places.last, self.odometry.latest
        if last is None or odometry is None:
            return False
        return math.dist(last.goal.position, (odometry.pose.x, odometry.pose.y)) <= THERE

    def _ground(self) -> Ground:
        """Return the ground by the map as it is now; raises RequestRefused if that is of no use."""
        message, odometry = self.map.latest, self.odometry.latest
        assert message is not None
        assert odometry is not None
        known = self._known
        if known and known[0] is message and known[1] is odometry and known[2] == self.radius:
            return known[3]
        try:
            ground = Ground.of(grid_of(message), planar_pose(odometry.pose).position, self.radius)
        except ValueError as error:
            self.kit.diagnose("map", Level.ERROR, f"the map is of no use: {error}")
            raise RequestRefused(f"the map is of no use: {error}", RefusalCode.UNAVAILABLE) from None
        self._known = (message, odometry, self.radius, ground)
        return ground

    def _look(self) -> _Look:
        """Look at the map as it is now; raises RequestRefused if it is of no use."""
        ground = self._ground()
        settings = FrontierSettings(self.radius, self.turning_room, self.min_length, self.min_area, self.range_max)
        found = find_frontiers(ground, settings, self._places.useless(ground))
        frontiers = [each for each in found if self._places.open(each, ground)]
        self._seen = _Look(ground, frontiers)
        return self._seen

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        """Return the ``distance`` (m) to drive and the number of ``requests`` to explore ``context["area"]`` (m²)."""
        return forecast(str(parameters.get("strategy", cls.strategy.default)), context)

    def evaluate(self) -> dict[str, float]:
        """Return what the last request has shown, and what was given since this component was configured.

        ``known_area`` (m²) and ``frontiers_left`` are as of the last request; ``requests`` is how many there were,
        ``distance`` (m) how far it was to all the frontiers that were given.
        """
        if self._seen is None:
            return {}
        return {
            "known_area": self._seen.ground.known_area(),
            "frontiers_left": float(len(self._seen.frontiers)),
            "requests": float(self._requests),
            "distance": self._distance,
        }

    def snapshot(self) -> PlainValue:
        """Return what was given and what there is no use in giving."""
        return self._places.snapshot()

    def restore(self, state: PlainValue) -> None:
        """Take over what a predecessor has given."""
        self._places.restore(state)
