"""Groups of people who come and go: by a schedule, and by a parameter of the world."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Final

from regraft.bus_schema.annotations import Text
from regraft.bus_schema.suggestions import no_such
from regraft.component.parameters import Parameter, ParameterError
from regraft.sim_service.devices.core.failure_schedule import Since
from regraft.sim_service.people.walkers import Person

CROWD: Final = "crowd"
"""The parameter for groups that are present at any time of the schedule."""


@dataclass(frozen=True, slots=True)
class Crowding:
    """From ``at`` on, in simulated time, the people of a group are present, or absent."""

    at: Since
    group: Annotated[str, Text(64)]
    present: bool


class CrowdParameter(Parameter[str]):
    """The parameter ``crowd``: names of groups, separated by spaces, each of which some person has."""

    def __init__(self, people: Sequence[Person]) -> None:
        super().__init__("", "groups of people that are present, by the schedule 'crowds' or not; separated by spaces")
        self._groups = groups_of(people)
        self.__set_name__(type(self), CROWD)

    def checked(self, value: Any) -> str:
        """Return the names of groups; raises ParameterError for a group that no person has."""
        names = super().checked(value)
        problems = [(self.name, _unknown(name, self._groups)) for name in names.split() if name not in self._groups]
        if problems:
            raise ParameterError(problems)
        return names


def groups_of(people: Sequence[Person]) -> frozenset[str]:
    """Return the groups of people."""
    return frozenset(person.group for person in people if person.group)


def check_crowds(people: Sequence[Person], crowds: Sequence[Crowding]) -> None:
    """Check the schedule of groups; raises ParameterError with everything that is wrong."""
    groups = groups_of(people)
    problems: list[tuple[str, str]] = []
    for index, entry in enumerate(crowds):
        if entry.group not in groups:
            problems.append((f"crowds.{index}.group", _unknown(entry.group, groups)))
    if problems:
        raise ParameterError(problems)


def _unknown(name: str, groups: frozenset[str]) -> str:
    return f"no person has this group: {no_such('group', name, groups)}"


def present_groups(crowds: Sequence[Crowding], crowd: str, now: float) -> frozenset[str]:
    """Return the groups that are present at a time (s), by the schedule and by the parameter ``crowd``."""
    # Times are sums of ticks, so that a tick can lie a rounding error before the time that is meant.
    last = {entry.group: entry.present for entry in crowds if entry.at <= now + 1e-6}
    return frozenset(crowd.split()) | {group for group, present in last.items() if present}


def changes(before: frozenset[str], now: frozenset[str]) -> Iterator[tuple[str, bool]]:
    """Return the groups that go and come, and whether they are present now."""
    return ((group, group in now) for group in sorted(before ^ now))
