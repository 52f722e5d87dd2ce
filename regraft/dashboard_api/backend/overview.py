"""Puts architecture (what should be) and status (what is) together."""

from __future__ import annotations

from collections import Counter

from regraft.bus_schema.errors import BadKey
from regraft.bus_schema.messages.protocol.control import AskQualities, ControlCode, Qualities
from regraft.bus_schema.messages.protocol.host import ProcessState
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.suggestions import instead_of
from regraft.client import Client, ClientError, ComponentSeen
from regraft.client.errors import ControlRefused, NoSuchComponent
from regraft.dashboard_api.backend.manager import Manager
from regraft.dashboard_api.backend.views import (
    ComponentDetails,
    ComponentLine,
    ComponentList,
    HostLine,
    HostList,
    SystemOverview,
    TopicLine,
    TopicList,
)
from regraft.dashboard_api.http.problems import malformed, not_found, unavailable, violation

LISTEN_FOR = 0.5
"""Seconds that an overview waits for a component or host that has not told its status yet."""
LIVE_TIMEOUT = 1.0


class Overview:
    """The system at present."""

    def __init__(self, client: Client, manager: Manager) -> None:
        """Look through ``client``, and ask ``manager`` what should be."""
        self._client = client
        self._manager = manager

    def system(self) -> SystemOverview:
        """Return the system in one answer."""
        architecture = self._manager.last_architecture()
        seen = self._client.components(LISTEN_FOR)
        states = Counter(c.status.state.value if c.status and c.alive else "gone" for c in seen.values())
        return SystemOverview(
            self._client.system,
            architecture.revision if architecture else None,
            architecture.simulated if architecture else None,
            self._client.clock(),
            dict(sorted(states.items())),
            tuple(self._client.hosts(LISTEN_FOR)),
            tuple(_problems(seen, architecture)),
        )

    def components(self) -> ComponentList:
        """Return all components: those that should be, and those that are."""
        architecture = self._manager.last_architecture()
        seen = self._client.components(LISTEN_FOR)
        names = sorted(seen.keys() | (architecture.components.keys() if architecture else set()))
        lines = tuple(_line(name, seen.get(name), architecture) for name in names)
        return ComponentList(architecture.revision if architecture else None, lines)

    def component(self, name: str) -> ComponentDetails:
        """Return all that is known of a component; raises Problem for an unknown one."""
        architecture = self._manager.last_architecture()
        spec = architecture.components.get(name) if architecture else None
        everybody = self._client.components(LISTEN_FOR)
        seen = everybody.get(name)
        if spec is None and seen is None:
            known = everybody.keys() | (architecture.components.keys() if architecture else set())
            raise not_found(f"there is no component {name!r}; {instead_of(name, known)}")
        if seen is None:
            return ComponentDetails(name, False, None, spec, None, None, None)
        try:
            now = self._client.view(name, LIVE_TIMEOUT) if seen.alive else None
        except ClientError:
            now = None
        return ComponentDetails(name, seen.alive, seen.age, spec, seen.status, seen.process, now)

    def qualities(self, name: str, asked: AskQualities) -> Qualities:
        """Return what quality a component gives and would give; raises Problem."""
        try:
            return self._client.qualities(name, asked, LIVE_TIMEOUT)
        except (NoSuchComponent, BadKey):
            raise not_found(f"there is no living component {name!r}; {self._instead_of(name)}") from None
        except ControlRefused as error:
            if error.code is ControlCode.FAILED:
                raise unavailable(str(error)) from None
            raise malformed(*(violation("", problem, component=name) for problem in error.problems)) from None
        except ClientError as error:
            raise unavailable(str(error)) from None

    def logs(self, name: str, lines: int) -> tuple[str, ...]:
        """Return the last lines of a component's log; raises Problem."""
        seen = self._client.components(LISTEN_FOR).get(name)
        if seen is None or seen.host is None:
            hint = self._instead_of(name)
            raise not_found(f"no host runs a component {name!r}, so none keeps its log; {hint}")
        try:
            return self._client.logs(name, lines)
        except ClientError as error:
            raise unavailable(str(error)) from None

    def _instead_of(self, name: str) -> str:
        return instead_of(name, set(self._client.components(0.0)) - {name})

    def topics(self) -> TopicList:
        """Return all topics; raises Problem while the adaptation manager is silent."""
        architecture = self._manager.last_architecture() or self._manager.architecture()
        return TopicList(
            architecture.revision, tuple(_topic(name, architecture) for name in sorted(architecture.topics))
        )

    def hosts(self) -> HostList:
        """Return all hosts."""
        seen = self._client.hosts(LISTEN_FOR).values()
        return HostList(tuple(HostLine(h.name, h.alive, h.age, h.status, h.state, h.processes) for h in seen))


def _line(name: str, seen: ComponentSeen | None, architecture: Architecture | None) -> ComponentLine:
    spec = architecture.components.get(name) if architecture else None
    status = seen.status if seen else None
    process = seen.process if seen else None
    runs_at = seen.host if seen and seen.host else (spec.host if spec else None)
    return ComponentLine(
        name,
        spec.cls if spec else None,
        runs_at,
        spec.state if spec else None,
        status.state if status else None,
        seen.alive if seen else False,
        status.incarnation if status else None,
        seen.age if seen else None,
        process.pid if process else None,
        process.restarts if process else None,
        status.error if status else "",
        status.detail if status else "",
        status.values if status else {},
    )


def _topic(name: str, architecture: Architecture) -> TopicLine:
    spec = architecture.topics[name]
    return TopicLine(
        name,
        spec.type,
        spec.reliable,
        spec.rate,
        tuple(".".join(end) for end in architecture.writers(name)),
        tuple(".".join(end) for end in architecture.readers(name)),
    )


def _problems(seen: dict[str, ComponentSeen], architecture: Architecture | None) -> list[str]:
    problems = []
    if architecture is None:
        problems.append("the adaptation manager does not answer")
    for name, component in seen.items():
        if component.process and component.process.state is ProcessState.QUARANTINED:
            problems.append(f"{name} is quarantined: {component.process.exit_reason}")
        elif component.status and component.status.error:
            problems.append(f"{name}: {component.status.error}")
    for name, spec in architecture.components.items() if architecture else ():
        there = seen.get(name)
        managed_and_wanted = spec.managed and spec.state is not State.FINALIZED
        if managed_and_wanted and not (there and there.alive):
            problems.append(f"{name} should be {spec.state.value}, but is not there")
    return problems
