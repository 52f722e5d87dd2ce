"""Views by robot: the parts of a system that belong to each of its robots."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.robots.scopes import component_in_scope, in_scope, scope_of
from regraft.bus_schema.suggestions import no_such

ROBOTS: Final = "robots"
"""The parameter in which a world has its robots: a stack gives it ``$robots``."""


class NoSuchRobot(ValueError):
    """A system has no robot of that name."""


@dataclass(frozen=True, slots=True)
class RobotView:
    """The part of a system that belongs to one robot among several; with an empty name, all of it.

    A robot has its components, what these offer, the topics of its name, and those that its components use. Names alone
    decide: a component that joins or is added later belongs to it, too.
    """

    robot: str

    def has_component(self, name: str) -> bool:
        """Return whether a component belongs to it."""
        return not self.robot or scope_of(name, (self.robot,)) == self.robot

    def has_topic(self, name: str, users: Iterable[str]) -> bool:
        """Return whether a topic does, which components ``users`` write and read."""
        return not self.robot or name.startswith(f"{self.robot}/") or any(map(self.has_component, users))

    def has_mode(self, name: str) -> bool:
        """Return whether a mode does."""
        return not self.robot or name.startswith(f"{self.robot}/")

    def has_part(self, name: str) -> bool:
        """Return whether a part with modes does: the robot itself, a component or subsystem of it."""
        return not self.robot or name == self.robot or name.startswith(f"{self.robot}.")

    def mode(self, name: str) -> str:
        """Return the mode that a name means to those who speak of this robot.

        >>> rescuer = RobotView("rescuer")
        >>> rescuer.mode("slow"), rescuer.mode("rescuer/slow"), ALL.mode("slow")
        ('rescuer/slow', 'rescuer/slow', 'slow')
        """
        return name if self.has_mode(name) else in_scope(self.robot, name)

    def part(self, name: str) -> str:
        """Return the part with modes that a name means to those who speak of this robot; an empty name stays so.

        >>> rescuer = RobotView("rescuer")
        >>> rescuer.part("laser"), rescuer.part("rescuer"), ALL.part("laser")
        ('rescuer.laser', 'rescuer', 'laser')
        """
        return name if not name or self.has_part(name) else component_in_scope(self.robot, name)


ALL = RobotView("")


def robots_of(components: Mapping[str, ComponentSpec], scopes: Collection[str]) -> frozenset[str]:
    """Return the robots among several of a system: those with components, and those that its world simulates.

    >>> world = ComponentSpec("world", parameters={ROBOTS: [{"name": "left"}, {"name": "buoy"}]})
    >>> sorted(robots_of({"left.eye": ComponentSpec("left.eye"), "world": world}, {"left"}))
    ['buoy', 'left']
    """
    with_components = (scope_of(name, scopes) for name in components)
    return frozenset(filter(None, (*with_components, *simulated_robots(components))))


def simulated_robots(components: Mapping[str, ComponentSpec]) -> tuple[str, ...]:
    """Return the names of the robots that the worlds among components simulate; it is empty for a single robot."""
    return tuple(name for spec in components.values() for name in _simulated(spec.parameters.get(ROBOTS)))


def _simulated(robots: PlainValue) -> Iterator[str]:
    for robot in robots if isinstance(robots, list) else ():
        name = robot.get("name") if isinstance(robot, dict) else None
        if isinstance(name, str):
            yield name


def robot_view(robot: str, components: Mapping[str, ComponentSpec], scopes: Collection[str]) -> RobotView:
    """Return the view of a robot; raises NoSuchRobot, which names the robots that there are."""
    if not robot:
        return ALL
    known = robots_of(components, scopes)
    if robot not in known:
        raise NoSuchRobot(no_such("robot", robot, known))
    return RobotView(robot)
