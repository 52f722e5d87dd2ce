"""Puts architecture (what should be) and status (what is) together."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

from regraft.bus_schema.errors import BadKey
from regraft.bus_schema.messages.management.modes import SystemModes
from regraft.bus_schema.messages.protocol.control import AskQualities, ControlCode, Qualities
from regraft.bus_schema.messages.protocol.host import ProcessState
from regraft.bus_schema.messages.protocol.usage import HostUsage
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.robots.robot_view import ALL, NoSuchRobot, RobotView, robot_view
from regraft.bus_schema.suggestions import instead_of, no_such
from regraft.client import Client, ClientError, ComponentSeen
from regraft.client.capability import capability
from regraft.client.errors import ControlRefused, NoSuchComponent
from regraft.client.qualities import qualities_now
from regraft.dashboard_api.backend.manager import Manager
from regraft.dashboard_api.backend.views import (
    ComponentDetails,
    ComponentLine,
    ComponentList,
    HostLine,
    HostList,
    QualityList,
    SystemOverview,
    TopicLine,
    TopicList,
)
from regraft.dashboard_api.http.problems import malformed, not_found, unavailable, violation

LISTEN_FOR = 0.5
"""Seconds that an overview waits for a component or host that has not published its status yet."""
LIVE_TIMEOUT = 1.0


class Overview:
    """The system at present."""

    def __init__(self, client: Client, manager: Manager) -> None:
        """Look through ``client``, and ask ``manager`` what should be."""
        self._client = client
        self._manager = manager

    def system(self) -> SystemOverview:
        """Return the system in one answer."""
        architecture, present = self._architectures()
        seen = self._client.components(LISTEN_FOR)
        states = Counter(c.state.value if c.state and c.alive else "gone" for c in seen.values())
        return SystemOverview(
            self._client.system,
            present.revision if present else None,
            present.simulated if present else None,
            self._client.clock(),
            dict(sorted(states.items())),
            tuple(self._client.hosts(LISTEN_FOR)),
            tuple(_problems(seen, architecture, present)),
        )

    def _architectures(self) -> tuple[Architecture | None, Architecture | None]:
        """Return the last architecture that was read, and the same if the manager has not fallen silent since."""
        last = self._manager.last_architecture()
        return last, None if self._manager.is_silent else last

    def _view(self, robot: str) -> RobotView:
        return view_of(robot, self._manager.last_architecture() or self._manager.architecture()) if robot else ALL

    def components(self, robot: str = "") -> ComponentList:
        """Return the components, all or a robot's: those that should be, and those that are; raises Problem."""
        view = self._view(robot)
        architecture, present = self._architectures()
        specs = architecture.components if architecture else {}
        seen = self._client.components(LISTEN_FOR)
        names = sorted(filter(view.has_component, seen.keys() | specs.keys()))
        lines = tuple(_line(seen.get(name, ComponentSeen(name)), specs.get(name)) for name in names)
        return ComponentList(present.revision if present else None, lines)

    def component(self, name: str) -> ComponentDetails:
        """Return all that is known of a component; raises Problem for an unknown one."""
        architecture = self._manager.last_architecture()
        specs = architecture.components if architecture else {}
        everybody = self._client.components(LISTEN_FOR)
        if name not in specs and name not in everybody:
            raise not_found(no_such("component", name, everybody.keys() | specs.keys()))
        seen = everybody.get(name, ComponentSeen(name))
        try:
            now = self._client.view(name, LIVE_TIMEOUT) if seen.alive else None
        except ClientError:
            now = None
        return ComponentDetails(name, seen.alive, seen.age, specs.get(name), seen.status, seen.process, now)

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

    def measured(self, robot: str = "") -> QualityList:
        """Return what components measure, all or a robot's; raises Problem."""
        architecture = self._manager.last_architecture() or self._manager.architecture()
        view = view_of(robot, architecture)
        specs = {name: spec for name, spec in architecture.components.items() if view.has_component(name)}
        return QualityList(qualities_now(self._client, specs, LISTEN_FOR))

    def modes(self, robot: str, *, reachable: bool) -> SystemModes:
        """Return the modes of all parts, or of a robot's; raises Problem."""
        found = self._manager.modes(reachable=reachable)
        if not robot:
            return found
        view = view_of(robot, self._manager.last_architecture() or self._manager.architecture())
        return replace(found, parts=tuple(part for part in found.parts if view.has_part(part.part)))

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

    def topics(self, robot: str = "") -> TopicList:
        """Return the topics, all or a robot's; raises Problem, also while the adaptation manager is silent."""
        architecture = self._manager.last_architecture() or self._manager.architecture()
        view = view_of(robot, architecture)
        names = [name for name in sorted(architecture.topics) if view.has_topic(name, _users(name, architecture))]
        return TopicList(architecture.revision, tuple(_topic(name, architecture) for name in names))

    def hosts(self, *, measured: bool = False) -> HostList:
        """Return all hosts, with what their components take if that is to be ``measured``."""
        _, present = self._architectures()
        lines = []
        for host in self._client.hosts(LISTEN_FOR).values():
            usage = self._usage(host.name) if measured and host.alive else None
            can = capability(present, host.name, usage, host.offer) if present else None
            lines.append(HostLine(host.name, host.alive, host.age, host.status, host.state, host.processes, can))
        return HostList(tuple(lines))

    def _usage(self, host: str) -> HostUsage | None:
        try:
            return self._client.usage(host, LIVE_TIMEOUT)
        except ClientError:
            return None


def _line(seen: ComponentSeen, spec: ComponentSpec | None) -> ComponentLine:
    return ComponentLine(
        seen.name,
        spec.cls if spec else None,
        seen.host or (spec.host if spec else None),
        spec.state if spec else None,
        seen.state,
        seen.alive,
        seen.status.incarnation if seen.status else None,
        seen.age,
        seen.process.pid if seen.process else None,
        seen.process.restarts if seen.process else None,
        seen.error,
        seen.failure,
        seen.detail,
        seen.values,
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


def _users(topic: str, architecture: Architecture) -> set[str]:
    return {component for component, _ in (*architecture.writers(topic), *architecture.readers(topic))}


def view_of(robot: str, architecture: Architecture) -> RobotView:
    """Return what of an architecture belongs to a robot, all for an empty name; raises Problem for an unknown one."""
    try:
        return robot_view(robot, architecture.components, architecture.scopes)
    except NoSuchRobot as error:
        raise not_found(str(error)) from None


def _problems(
    seen: dict[str, ComponentSeen], architecture: Architecture | None, present: Architecture | None
) -> list[str]:
    problems = []
    if present is None:
        problems.append("the adaptation manager does not answer")
    for name, component in seen.items():
        if component.process and component.process.state is ProcessState.QUARANTINED:
            problems.append(f"{name} is quarantined: {component.process.exit_reason}")
        elif component.failure:
            problems.append(f"{name} has failed: {component.failure}")
        elif component.error:
            problems.append(f"{name}: {component.error}")
    for name, spec in architecture.components.items() if architecture else ():
        managed_and_wanted = spec.managed and spec.state is not State.FINALIZED
        if managed_and_wanted and not seen.get(name, ComponentSeen(name)).alive:
            problems.append(f"{name} should be {spec.state.value}, but is not there")
    return problems
