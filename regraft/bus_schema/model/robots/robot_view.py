"""Views by robot: the parts of a system that belong to each of its robots."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass

from regraft.bus_schema.model.robots.scopes import scope_of
from regraft.bus_schema.suggestions import no_such


class NoSuchRobot(ValueError):
    """A system has no robot of that name."""


@dataclass(frozen=True, slots=True)
class RobotView:
    """The part of a system that belongs to one robot among several; with an empty name, all of it.

    A robot has its components, what these offer, the topics of its name, and those that its components use.
    """

    robot: str
    own: frozenset[str] = frozenset()

    def has_component(self, name: str) -> bool:
        """Return whether a component belongs to it."""
        return not self.robot or name in self.own

    def has_topic(self, name: str, users: Iterable[str]) -> bool:
        """Return whether a topic does, which components ``users`` write and read."""
        return not self.robot or name.startswith(f"{self.robot}/") or not self.own.isdisjoint(users)

    def has_mode(self, name: str) -> bool:
        """Return whether a mode does."""
        return not self.robot or name.startswith(f"{self.robot}/")


ALL = RobotView("")


def robots_of(components: Iterable[str], topics: Collection[str]) -> frozenset[str]:
    """Return the robots among several whose components these are.

    >>> sorted(robots_of(["left.eye", "right.eye", "world"], ["left/scan", "right/scan"]))
    ['left', 'right']
    """
    return frozenset(filter(None, (scope_of(name, topics) for name in components)))


def robot_view(robot: str, components: Collection[str], topics: Collection[str]) -> RobotView:
    """Return the view of a robot; raises NoSuchRobot, which says what robots there are."""
    if not robot:
        return ALL
    known = robots_of(components, topics)
    if robot not in known:
        raise NoSuchRobot(no_such("robot", robot, known))
    return RobotView(robot, frozenset(name for name in components if scope_of(name, topics) == robot))
