"""The obstacles component: goals from which to look at what stands in the room."""

from __future__ import annotations

import math

from regraft import Component, Input, Output, Parameter, Quality, every
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages import geometry, maps, sensors
from regraft.bus_schema.messages.health import Level
from regraft.bus_schema.model.description import Resources
from regraft.services import robot_parameters
from regraft.services.explorer.ground import Ground
from regraft.services.navigator.conversions import grid_of, planar_pose, same_map
from regraft.services.obstacles.survey import Survey, SurveySettings, Viewed
from regraft.services.obstacles.views import ViewSettings


class Obstacles(Component):
    """Finds objects in the room on the map, and viewing poses in the order of a short tour.

    Walls are no objects. An object keeps its name, and its goal where that is still good, from one map to the next.
    With another ``standoff`` all goals are looked for again.
    """

    handler_timeout = 2.0
    state_version = 2
    checkpoint_every = 5.0
    resources = Resources(cpu=0.02, memory=25.0)

    rate = Parameter(1.0, "how often a changed map is looked at, at the most", minimum=0.01, maximum=10.0, unit="Hz")
    repeat = Parameter(5.0, "interval of repeating unchanged goals", minimum=0.1, unit="s")
    standoff = Parameter(0.65, "how far from an object to look at it", minimum=0.3, maximum=2.0, unit="m")
    room = robot_parameters.turning_room()
    radius = robot_parameters.radius()
    smallest = Parameter(0.12, "diagonal below which an object is noise", minimum=0.0, unit="m")
    largest = Parameter(1.5, "diagonal above which an object is a wall", minimum=0.0, unit="m")

    viewing_distance = Quality("mean, from the middles of objects", unit="m", better="lower", minimum=0.0)
    clearance = Quality("the least around a goal", unit="m", better="higher", minimum=0.0)
    objects = Quality("that are on the map", minimum=0.0, functional=True, estimated=False)
    goals_found = Quality("from where they can be seen", minimum=0.0, functional=True, estimated=False, name="goals")

    map = Input(maps.OccupancyGrid, latest_only=True, description="what is known so far")
    odometry = Input(sensors.Odometry, latest_only=True, description="where the robot is in the map")
    goals = Output(maps.Goals, description="where to look at the objects from, in the order of the visits")

    def on_configure(self) -> None:
        """Begin without having seen anything."""
        self._survey = Survey()
        self._known_map: maps.OccupancyGrid | None = None
        self._ground: Ground | None = None
        self._viewed: list[Viewed] = []
        self._told_at = -math.inf

    def on_activate(self) -> None:
        """Look at the map again, and publish the goals."""
        self._known_map = None

    def on_parameters(self, changed: frozenset[str]) -> None:
        """Look at the map again, as other things may count now."""
        self._known_map = None

    @every(hz=rate)
    def look(self) -> None:
        """Publish the goals of a new map at once, and those of an unchanged one now and then."""
        message, odometry = self.map.latest, self.odometry.latest
        if message is None or odometry is None:
            return
        if self._is_new(message) and not self._take(message, odometry):
            return
        if self.kit.now() - self._told_at >= self.repeat:
            self._tell(message.frame)

    def _is_new(self, message: maps.OccupancyGrid) -> bool:
        known, self._known_map = self._known_map, message
        return message is not known and (known is None or not same_map(message, known))

    def _take(self, message: maps.OccupancyGrid, odometry: sensors.Odometry) -> bool:
        """Look at a new map; return whether it is of use."""
        try:
            ground = Ground.of(grid_of(message), planar_pose(odometry.pose).position, self.radius)
        except ValueError as error:
            self._known_map = None  # the next look may find the robot elsewhere
            self.kit.diagnose("map", Level.ERROR, f"the map is of no use: {error}")
            return False
        settings = SurveySettings(self.smallest, self.largest, ViewSettings(self.standoff, self.room))
        self._ground, self._viewed = ground, self._survey.look(ground, settings)
        self._told_at = -math.inf
        return True

    def _tell(self, frame: str) -> None:
        goals = tuple(
            maps.NamedGoal(each.name, geometry.FramedPose(frame, geometry.Pose.planar(*_parts(each))))
            for each in self._viewed
            if each.pose is not None
        )
        self._told_at = self.kit.now()
        self.kit.set_status_text(f"{len(self._viewed)} objects, {len(goals)} of them to be looked at")
        self.goals.publish(maps.Goals(self._told_at, goals))

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        """Return how far (m) goals are from what they show, and from everything.

        ``viewing_distance`` is the mean distance from the middles of objects of ``context["size"]`` (m). ``clearance``
        is the least around a goal.
        """
        size = float(context.get("size", 0.25))
        standoff = float(parameters.get("standoff", cls.standoff.default))
        # Seen from all directions, a square of this side reaches 0.56 of it from its middle on average.
        return {
            "viewing_distance": standoff + 0.56 * size,
            "clearance": float(parameters.get("room", cls.room.default)),
        }

    def evaluate(self) -> dict[str, float]:
        """Return how many ``objects`` and ``goals`` there are, and ``viewing_distance`` and ``clearance`` (m)."""
        seen = [each for each in self._viewed if each.pose is not None]
        counted = {"objects": float(len(self._viewed)), "goals": float(len(seen))}
        if not seen or self._ground is None:
            return counted
        grid, room = self._ground.grid, self._ground.room
        cells = [grid.cell_of(each.pose.position) for each in seen if each.pose is not None]
        distance = math.fsum(each.distance for each in seen) / len(seen)
        return counted | {"viewing_distance": distance, "clearance": min(float(room[cell]) for cell in cells)}

    def snapshot(self) -> PlainValue:
        """Return the names and the poses."""
        return self._survey.snapshot()

    def restore(self, state: PlainValue) -> None:
        """Take over names and poses, so that what was visited is known by its name."""
        self._survey.restore(state)


def _parts(viewed: Viewed) -> tuple[float, float, float]:
    """Return x, y (m) and yaw (rad) of the pose to look at something."""
    assert viewed.pose is not None
    return viewed.pose.x, viewed.pose.y, viewed.pose.yaw
