"""The components that run missions, and the one that is meant where a system has several."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.robots.offered_services import offered_services
from regraft.bus_schema.model.robots.scopes import in_scope, scope_of
from regraft.bus_schema.suggestions import instead_of

STATUS, COMMAND = "mission/status", "mission/command"
BLACKBOARD, WRITE = "mission/blackboard", "mission/write"
COUNTS, BREAKPOINTS = "mission/counts", "mission/breakpoints"
"""The services of an executor, as its class names them."""
TRANSITIONS = "transitions"
"""The output of an executor with the changes of its nodes' statuses."""
TRANSITIONS_TOPIC = "mission/transitions"


class WhichExecutor(ValueError):
    """A system has several executors, and none of them is named."""


class NoSuchExecutor(ValueError):
    """No robot or component of that name runs missions."""


@dataclass(frozen=True, slots=True)
class MissionExecutor:
    """A component that runs missions, and the robot among several whose missions these are; empty for none.

    ``services`` has the names under which its own ``mission/...`` are offered. Without a component it is the executor
    that a system with short names may have.
    """

    component: str = ""
    robot: str = ""
    services: Mapping[str, str] = field(default_factory=dict)
    transitions: str = TRANSITIONS_TOPIC

    def service(self, name: str) -> str:
        """Return the name under which one of the services is offered."""
        return self.services.get(name, name)


def executors(components: Mapping[str, ComponentSpec], scopes: Collection[str]) -> tuple[MissionExecutor, ...]:
    """Return all components that run missions, by name."""
    return tuple(
        _executor(name, components[name], scope_of(name, scopes))
        for name in sorted(components)
        if STATUS in offered_services(components[name])
    )


def _executor(name: str, spec: ComponentSpec, scope: str) -> MissionExecutor:
    transitions = spec.connections.get(TRANSITIONS) or in_scope(scope, TRANSITIONS_TOPIC)
    return MissionExecutor(name, scope, offered_services(spec), transitions)


def executor_of(known: Collection[MissionExecutor], name: str) -> MissionExecutor | None:
    """Return the executor of the robot, or with the component's name, that is given; without a name, the only one.

    None if there is none at all, and none is named.

    Raises:
        NoSuchExecutor: neither a robot nor a component of that name runs missions.
        WhichExecutor: there are several, and none is named.
    """
    found = [each for each in known if name in ("", each.robot, each.component)]
    if len(found) == 1 or not (name or found):
        return found[0] if found else None
    if not found:
        names = {each.robot or each.component for each in known}
        raise NoSuchExecutor(f"no robot or component {name!r} runs missions; {instead_of(name, names)}")
    if name:
        raise WhichExecutor(f"several components of {name!r} run missions: {_listed(found)}: name one of them")
    raise WhichExecutor(f"several robots run missions: {_listed(found)}: name one of them")


def _listed(found: Collection[MissionExecutor]) -> str:
    robots = [each.robot for each in found]
    return ", ".join(each.robot if robots.count(each.robot) == 1 and each.robot else each.component for each in found)
