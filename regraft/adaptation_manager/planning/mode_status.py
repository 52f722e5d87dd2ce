"""Reports the modes of all parts: what was asked for, what is, and what could be."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from regraft.adaptation_manager.planning.checks import check
from regraft.adaptation_manager.planning.modes import NoSuchMode, changes_of
from regraft.adaptation_manager.planning.read_components import Read, read_components
from regraft.adaptation_manager.targets.component_client import ComponentClient
from regraft.adaptation_manager.targets.host_client import Hosts
from regraft.bus_schema.messages.management.modes import ModeStatus, PartModes, SystemModes
from regraft.bus_schema.model.adaptation import AdaptationRequest, Change, EnterMode
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.lifecycle import State, is_lower
from regraft.bus_schema.model.modes.mode_deciders import deciders
from regraft.bus_schema.model.modes.mode_inference import UNKNOWN, actual_mode, as_read, state_of_many
from regraft.bus_schema.model.modes.mode_parts import SYSTEM, PartKind, kind_of, modes_by_part
from regraft.bus_schema.model.modes.modes import is_in_force

if TYPE_CHECKING:
    from regraft import Kit


async def read_modes(
    wanted: Architecture, controls: ComponentClient, hosts: Hosts, kit: Kit, *, reachable: bool
) -> SystemModes:
    """Return the modes of all parts, ``wanted`` being the architecture; raises ControlFailed."""
    controls.processes |= await hosts.met(wanted, {spec.host for spec in wanted.components.values()})
    managed = [name for name, spec in sorted(wanted.components.items()) if spec.managed]
    found = await read_components(managed, wanted, controls, hosts)
    problems: dict[str, str] | None = None
    if reachable:
        problems = {mode: await _problem(mode, wanted, controls, hosts, kit.name) for mode in wanted.modes}
    return _Report(wanted, found, problems).modes(kit.now())


async def _problem(mode: str, wanted: Architecture, controls: ComponentClient, hosts: Hosts, manager: str) -> str:
    """Return why a mode cannot be entered now, empty if it can."""
    request = AdaptationRequest((EnterMode(mode),), dry_run=True)
    violations, _ = await check(request, wanted, controls, hosts, manager)
    return "; ".join(map(str, violations))


class _Report:
    """All parts as they were read; ``problems`` are why modes cannot be entered, None if that was not asked."""

    def __init__(self, wanted: Architecture, found: Read, problems: Mapping[str, str] | None) -> None:
        self._wanted = wanted
        self._found = found
        self._problems = problems
        self._states = {name: self._state(spec) for name, spec in wanted.components.items() if spec.managed}
        self._actual = wanted
        for name, spec in wanted.components.items():
            self._actual = self._actual.with_component(self._as_read(name, spec))
        self._changes = {mode: _readable(mode, wanted) for mode in wanted.modes}

    def modes(self, stamp: float) -> SystemModes:
        """Return the system's part first, then the others by name."""
        wanted = self._wanted
        of_parts = modes_by_part(wanted.modes)
        names = sorted({SYSTEM, *of_parts, *self._states})
        decider = next(iter(deciders(wanted.components.values())), "")
        parts = tuple(self._part(name, of_parts.get(name, [])) for name in names)
        return SystemModes(stamp, wanted.revision, parts, decider)

    def _part(self, part: str, names: list[str]) -> PartModes:
        wanted = self._wanted
        kind = kind_of(part, wanted.components, wanted.scopes)
        modes = {name: self._changes[name] for name in names}
        target = wanted.asked_modes.get(part, "")
        actual, fitting = actual_mode(modes, target, wanted, self._actual)
        spec = wanted.components.get(part)
        concerned = self._concerned(part, kind, modes)
        return PartModes(
            part,
            kind,
            target,
            actual,
            target not in modes or is_in_force(modes[target], wanted),
            self._states.get(part, "") if spec else self._state_of(concerned, target, actual),
            spec.state.value if spec else "",
            self._failure(part) if spec else "; ".join(filter(None, map(self._failure, concerned))),
            tuple(self._status(name, name in fitting) for name in names),
        )

    def _status(self, mode: str, fits: bool) -> ModeStatus:
        if self._problems is None:
            return ModeStatus(mode, fits)
        return ModeStatus(mode, fits, not self._problems[mode], self._problems[mode])

    def _concerned(self, part: str, kind: PartKind, modes: Mapping[str, tuple[Change, ...]]) -> list[str]:
        """Return the components of a part: a robot's, those that its modes name, else all."""
        if kind is PartKind.ROBOT:
            return [name for name in self._states if name.startswith(f"{part}.")]
        named = {change.component for changes in modes.values() for change in changes}
        return [name for name in self._states if name in named or (kind is PartKind.SYSTEM and not named)]

    def _state_of(self, components: list[str], target: str, actual: str) -> str:
        failed = any(self._failure(name) for name in components)
        states = (
            [State.ERROR_PROCESSING.value] if failed and not actual else [self._states[name] for name in components]
        )
        return state_of_many(states, asked=target, actual=actual)

    def _failure(self, name: str) -> str:
        """Return why a component is not what it should be, empty if it is."""
        spec, live = self._wanted.components.get(name), self._found.live.get(name)
        if spec is None or not spec.managed:
            return ""
        if live is None:
            return f"{name} {self._found.silent[name].why}" if spec.state is State.ACTIVE else ""
        if is_lower(live.state, spec.state):
            return f"{name} is {live.state.value}, and should be {spec.state.value}"
        return ""

    def _state(self, spec: ComponentSpec) -> str:
        live = self._found.live.get(spec.name)
        return live.state.value if live else UNKNOWN

    def _as_read(self, name: str, spec: ComponentSpec) -> ComponentSpec:
        """Return a component as it is: one without a run does as little as one that is not configured."""
        live, silent = self._found.live.get(name), self._found.silent.get(name)
        if live is not None:
            return as_read(spec, live.state, live.parameters, live.connections)
        if silent is None:
            return spec
        return as_read(spec, State.UNCONFIGURED if silent.broken else State.ERROR_PROCESSING, {}, {})


def _readable(mode: str, architecture: Architecture) -> tuple[Change, ...]:
    try:
        return changes_of(mode, architecture)
    except NoSuchMode:
        return (EnterMode(mode),)  # which nothing fits
