"""People who walk through the world, for robots to stop for.

The world file has a body for each that slides along x and y and turns about z. The joints of ``visitor`` are
``visitor_x``, ``visitor_y`` and ``visitor_yaw``. A person is moved along their way; nothing pushes them aside. Cameras
and lidars see them. People do not see each other.

People of a group come and go together. While they are absent, their bodies stand where the file has them, outside of
the building.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Any

import mujoco

from regraft.bus_schema.annotations import Bounds, Metres, Text, Unit
from regraft.bus_schema.errors import BadMessage
from regraft.planar import Pose2D
from regraft.sim_service.layout.scene import Scene

JOINTS = ("x", "y", "yaw")
COURTESY = 0.55
"""m: by default, people wait while their next step would bring them this near to a robot's middle."""
MAX_SPEED = 3.0
ENTRY_STEP = 0.05
"""m between two places that are tried for somebody who enters."""


@dataclass(frozen=True, slots=True)
class Waypoint:
    """A place of a walk (map frame)."""

    x: Metres
    y: Metres


@dataclass(frozen=True, slots=True)
class Person:
    """Somebody who walks straight from waypoint to waypoint (m, map frame) at a speed, and back.

    In a ``loop`` they walk from the last waypoint straight to the first, instead of back.
    """

    name: Annotated[str, Text(64)]
    """The body of the world; its joints begin with it."""
    waypoints: tuple[Waypoint, ...]
    speed: Annotated[float, Unit("m/s"), Bounds(0.01, MAX_SPEED)] = 0.3
    group: Annotated[str, Text(64)] = ""
    """The group with which they come and go; without one they are always present."""
    loop: bool = False
    courtesy: Annotated[Metres, Bounds(0.0, 5.0)] = COURTESY
    """They wait while their next step would bring them this near to a robot's middle."""

    def __post_init__(self) -> None:
        """Check the waypoints and the group; raises BadMessage."""
        if any(letter.isspace() for letter in self.group):
            raise BadMessage(f"{self.group!r}: must be a name without spaces", ("group",))
        if len(self.waypoints) < 2 or any(a == b for a, b in self._stretches()):
            problem = "must have two or more waypoints, neighbours at different places"
            closing = ", the last and the first of a loop too" if self.loop else ""
            raise BadMessage(f"{self.name} {problem}{closing}", ("waypoints",))

    def _stretches(self) -> Iterator[tuple[Waypoint, Waypoint]]:
        """Return the pairs of waypoints between which the way is straight."""
        return pairwise((*self.waypoints, self.waypoints[0]) if self.loop else self.waypoints)

    def legs(self) -> tuple[Leg, ...]:
        """Return the straight parts of the way, in order."""
        return tuple(Leg(a.x, a.y, b.x, b.y) for a, b in self._stretches())


@dataclass(frozen=True, slots=True)
class Leg:
    """A straight part of a way (m, map frame)."""

    x: float
    y: float
    to_x: float
    to_y: float

    @property
    def length(self) -> float:
        """The length (m)."""
        return math.dist((self.x, self.y), (self.to_x, self.to_y))


class Way:
    """The way of a person, with the lengths of its legs."""

    def __init__(self, person: Person) -> None:
        self._legs = [(leg, leg.length) for leg in person.legs()]
        self.length = sum(length for _, length in self._legs)
        """The length (m) of the way to the last waypoint, or once around a loop."""
        self._period = self.length if person.loop else 2.0 * self.length

    def pose(self, travelled: float) -> Pose2D:
        """Return where somebody is who has walked so far (m), facing where they go."""
        since = travelled % self._period
        going = since <= self.length
        leg, share = self._leg_at(since if going else self._period - since)
        along_x, along_y = leg.to_x - leg.x, leg.to_y - leg.y
        yaw = math.atan2(along_y, along_x) if going else math.atan2(leg.y - leg.to_y, leg.x - leg.to_x)
        return Pose2D(leg.x + share * along_x, leg.y + share * along_y, yaw)

    def _leg_at(self, left: float) -> tuple[Leg, float]:
        """Return the leg on which a place is, some metres along the way, and the share behind it."""
        for leg, length in self._legs:
            if left <= length:
                return leg, left / length
            left -= length
        return self._legs[-1][0], 1.0


class Walker:
    """Moves one person of a running world; raises SceneError if the world has nobody of this name."""

    def __init__(self, scene: Scene, walk: Person) -> None:
        model = scene.model
        joints = [scene.index("joint", f"{walk.name}_{axis}") for axis in JOINTS]
        self._positions = [int(model.jnt_qposadr[joint]) for joint in joints]
        self._velocities = [int(model.jnt_dofadr[joint]) for joint in joints]
        body = int(model.jnt_bodyid[joints[0]])
        self._origin = (float(model.body_pos[body][0]), float(model.body_pos[body][1]))
        self._walk = walk
        self._way = Way(walk)
        self._travelled = 0.0
        self.is_present = not walk.group
        """Whether the person is to walk; somebody who is absent stands outside."""
        self._is_inside = self.is_present

    @property
    def group(self) -> str:
        """The group with which the person comes and goes; empty for somebody who is always present."""
        return self._walk.group

    def begin(self, data: mujoco.MjData, robots: Sequence[Pose2D]) -> None:
        """Stand at the first place of the walk where no robot (map frame) stands, or outside if absent."""
        if self.is_present:
            self._travelled = self._entry(robots)
        self._put(data, 0.0)

    def set_present(self, data: mujoco.MjData, present: bool) -> None:
        """Have a person of a group come, with the next move, or go at once."""
        self.is_present = present
        if not present:
            self._is_inside = False
            self._put(data, 0.0)

    def move(self, data: mujoco.MjData, seconds: float, robots: Sequence[Pose2D]) -> None:
        """Walk on for some seconds, or wait for a robot to get out of the way; come in if that is to be."""
        if not self._is_inside:
            if self.is_present:
                self._come_in(robots)
                self._put(data, 0.0)
            return
        following = self._travelled + self._walk.speed * seconds
        pose = self._way.pose(following)
        distance = _nearest(pose, robots)
        if distance < self._walk.courtesy and distance <= self._nearest(self._travelled, robots):
            self._put(data, 0.0)
            return
        self._travelled = following
        self._stand(data, pose, self._walk.speed)

    def _come_in(self, robots: Sequence[Pose2D]) -> None:
        """Enter where no robot is near; a person for whom there is no such place stays outside."""
        entry = self._entry(robots)
        if self._nearest(entry, robots) >= self._walk.courtesy:
            self._is_inside, self._travelled = True, entry

    def _entry(self, robots: Sequence[Pose2D]) -> float:
        """Return how far (m) the first place is where no robot is near; the last place if there is none."""
        travelled = 0.0
        while travelled < self._way.length and self._nearest(travelled, robots) < self._walk.courtesy:
            travelled += ENTRY_STEP
        return travelled

    def _nearest(self, travelled: float, robots: Sequence[Pose2D]) -> float:
        """Return the distance (m) to the nearest robot from where the person is then."""
        return _nearest(self._way.pose(travelled), robots)

    def _put(self, data: mujoco.MjData, speed: float) -> None:
        if self._is_inside:
            self._stand(data, self._way.pose(self._travelled), speed)
        else:
            self._set(data, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))

    def _stand(self, data: mujoco.MjData, pose: Pose2D, speed: float) -> None:
        """Be at a pose (map frame) and go forward at a speed (m/s)."""
        place = (pose.x - self._origin[0], pose.y - self._origin[1], pose.yaw)
        self._set(data, place, (speed * math.cos(pose.yaw), speed * math.sin(pose.yaw), 0.0))

    def _set(self, data: mujoco.MjData, place: Sequence[float], motion: Sequence[float]) -> None:
        positions, velocities = data.qpos, data.qvel
        for position, velocity, value, rate in zip(self._positions, self._velocities, place, motion, strict=True):
            positions[position] = value
            velocities[velocity] = rate

    def snapshot(self) -> dict[str, Any]:
        """Return how far the person has walked, and of somebody who comes and goes whether they are there."""
        comes_and_goes = {"present": self.is_present, "inside": self._is_inside} if self.group else {}
        return {"travelled": self._travelled, **comes_and_goes}

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        """Take over how far the person had walked; where they are is part of the physics."""
        self._travelled = float(snapshot["travelled"])
        if self.group:
            self.is_present, self._is_inside = bool(snapshot["present"]), bool(snapshot["inside"])


def _nearest(pose: Pose2D, robots: Sequence[Pose2D]) -> float:
    """Return the distance (m) from a pose to the nearest robot."""
    return min((math.dist(pose.position, robot.position) for robot in robots), default=math.inf)
