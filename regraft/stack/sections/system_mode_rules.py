"""Reads the rules of a file of ROS 2's system_modes: targets that are replaced while a part is in another state."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.mode_rules import ModeRule
from regraft.bus_schema.model.modes.mode_conditions import GONE
from regraft.bus_schema.model.modes.mode_parts import DEFAULT
from regraft.bus_schema.model.robots.scopes import component_in_scope, in_scope
from regraft.bus_schema.suggestions import instead_of, no_such
from regraft.stack.yaml.nodes import Location, Node
from regraft.stack.yaml.problems import Report

TARGETS = ("if_target", "new_target")
FIELDS = ("if_target", "if_part", "new_target")
ACTIVE = State.ACTIVE.value
STATES = (*(state.value for state in State), "unknown")


@dataclass(slots=True)
class Part:
    """A node or a system: the settings of each mode, a parameter's value or a part's state."""

    name: str
    location: Location
    is_node: bool
    modes: dict[str, dict[str, Node]] = field(default_factory=dict)
    rules: dict[str, Node] = field(default_factory=dict)

    def settings(self, mode: str) -> dict[str, Node]:
        """Return what a mode wants, what it leaves out taken from the default."""
        return self.modes.get(DEFAULT, {}) | self.modes.get(mode, {})


@dataclass(frozen=True, slots=True)
class PartNames:
    """The meaning of the names of nodes and systems in a scope, which is empty for none."""

    scope: str

    def component(self, node: str) -> str:
        """Return the component that a node's name means: ``/robot/drive`` is ``robot.drive``."""
        return component_in_scope(self.scope, node.strip("/").replace("/", "."))

    def own(self, components: Iterable[str]) -> list[str]:
        """Return the components of the scope by their short names."""
        prefix = component_in_scope(self.scope, "")
        return [name.removeprefix(prefix) for name in components if name.startswith(prefix)]

    def mode(self, part: str, mode: str) -> str:
        """Return the name of a mode, or rule, of a part in the stack."""
        return in_scope(self.scope, f"{part.strip('/')}.{mode}") if self.scope else f"{part}.{mode}"


def rules_of(part: Part, parts: Mapping[str, Part], names: PartNames, report: Report) -> Iterator[ModeRule]:
    """Yield the rules of a system; what is wrong is noted."""
    for name, node in part.rules.items():
        where = f"{part.name}.rules.{name}"
        fields = node.value if isinstance(node.value, dict) else {}
        missing = [key for key in FIELDS if key not in fields]
        for key in fields:
            if key not in FIELDS:
                report.add_at(
                    fields[key].location, f"{where}.{key}", f"there is no such field; {instead_of(key, FIELDS)}"
                )
        if missing:
            report.add_at(node.location, where, f"must have {', '.join(map(repr, missing))}")
            continue
        start, mode = (_target(part, fields[key], f"{where}.{key}", names, report) for key in TARGETS)
        when = _condition(part, parts, fields["if_part"], f"{where}.if_part", names, report)
        if start and start == mode:
            report.add_at(fields["new_target"].location, f"{where}.new_target", "is 'if_target': must be another mode")
        elif start and mode and when:
            yield ModeRule(names.mode(part.name, name), when, mode, (start,))


def _target(part: Part, node: Node, where: str, names: PartNames, report: Report) -> str | None:
    state, _, mode = str(node.value).partition(".")
    if state != ACTIVE:
        report.add_at(node.location, where, f"{node.value!r}: must be active.MODE")
    elif (mode or DEFAULT) not in part.modes:
        report.add_at(node.location, where, f"{part.name}: {no_such('mode', mode, part.modes)}")
    else:
        return names.mode(part.name, mode or DEFAULT)
    return None


def _condition(
    part: Part, parts: Mapping[str, Part], node: Node, where: str, names: PartNames, report: Report
) -> str | None:
    """Return the condition that a part is in a state, and mode if one is given."""
    pair = node.value if isinstance(node.value, tuple) else ()
    if len(pair) != 2:
        report.add_at(node.location, where, "must be a list of a part and its state, such as [laser, inactive]")
        return None
    name, (state, _, mode) = str(pair[0].value), str(pair[1].value).partition(".")
    known = {each for settings in part.modes.values() for each in settings}
    if name not in known:
        report.add_at(node.location, where, f"{part.name}: {no_such('part', name, known)}")
    elif state not in STATES:
        report.add_at(node.location, where, f"{state!r} is no state; {instead_of(state, STATES)}")
    elif mode and mode not in (parts[name].modes if name in parts else {}):
        modes = parts[name].modes if name in parts else {}
        report.add_at(node.location, where, f"{name}: {no_such('mode', mode, modes)}")
    elif mode:
        return f"{names.component(name)}.mode == '{names.mode(name, mode)}'"
    elif name in parts and not parts[name].is_node:
        report.add_at(node.location, where, f"{name} is a system: name a mode of it, such as {ACTIVE}.{DEFAULT}")
    else:
        return f"{names.component(name)}.state == '{GONE if state == 'unknown' else state}'"
    return None
