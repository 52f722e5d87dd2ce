"""Reads the rules of a stack file: conditions under which modes are entered."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.model.adaptation import AdaptationRequest
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.mode_rules import LONGEST, ModeRule
from regraft.bus_schema.model.modes.mode_circles import find_circle
from regraft.bus_schema.model.modes.mode_conditions import condition_problems
from regraft.bus_schema.model.modes.mode_deciders import deciders, fed_as_needed
from regraft.bus_schema.model.modes.mode_parts import part_of
from regraft.bus_schema.suggestions import Hints, instead_of
from regraft.stack.sections.modes import ReadModes
from regraft.stack.yaml.nodes import Location, Node
from regraft.stack.yaml.section import Section

PLANNER = "regraft.adaptation_manager.planners.modes.mode_planner:ModePlanner"


def with_rules(root: Section, read: ReadModes) -> Architecture:
    """Return the architecture with the rules of ``rules``, after those of files of system_modes.

    Where the names of the modes are not known, what speaks of them is not judged: most of it would be wrong.
    """
    architecture, modes_known = read.architecture, read.names_known
    section = root.section("rules")
    before = len(root.report.problems)
    modes = architecture.modes if modes_known else None
    hints = Hints(modes or ())
    for name in read.rule_locations.keys() & set(section.names()):
        section.wrong(name, "a file of system_modes has a rule of this name, too: give this one another name")
    own = [_rule(section.section(name), name, modes, hints) for name in section.names()]
    found = replace(architecture, mode_rules=(*architecture.mode_rules, *filter(None, own)))
    described = all(spec.description or not spec.managed for spec in architecture.components.values())
    if own and described and not deciders(architecture.components.values()):
        root.wrong("rules", f"nobody enforces them: add a component of the class {PLANNER}")
    if described and modes_known and len(root.report.problems) == before:
        _check_conditions(root, found, read.rule_locations)
    table = root.section("components")
    fed = {
        name: fed_as_needed(spec, table.section(name).optional_text_map("connect"), found)
        for name, spec in found.components.items()
        if name in deciders((spec,))
    }
    return replace(found, components={**found.components, **fed})


def _rule(section: Section, name: str, modes: Collection[str] | None, hints: Hints) -> ModeRule | None:
    section.only("when", "mode", "from", "settle", "dwell", "because")
    before = len(section.report.problems)
    for field in ("when", "mode"):
        if field not in section:
            section.wrong(field, "is missing")
    mode = section.text("mode")
    start = _one_or_several(section, "from")
    if modes is not None:
        _check_modes(section, mode, start, modes, hints)
    rule = ModeRule(
        name,
        section.expression("when"),
        mode,
        start,
        section.number("settle", 0.0, LONGEST),
        section.number("dwell", 0.0, LONGEST),
        section.text("because"),
    )
    return rule if len(section.report.problems) == before else None


def _one_or_several(section: Section, key: str) -> tuple[str, ...]:
    node = section.node(key)
    if node is None or isinstance(node.value, tuple):
        return section.distinct(key)
    text = section.text(key)
    return (text,) if text else ()


def _check_modes(section: Section, mode: str, start: Iterable[str], modes: Collection[str], hints: Hints) -> None:
    if mode and mode not in modes:
        section.wrong("mode", hints.no_such("mode", mode))
    for each in start:
        if each not in modes:
            section.wrong("from", hints.no_such("mode", each))
        elif mode in modes and part_of(each) != part_of(mode):
            known = [other for other in modes if part_of(other) == part_of(mode)]
            section.wrong("from", f"{each!r} is a mode of another part than {mode!r}; {instead_of(each, known)}")
        elif each == mode:
            section.wrong("from", f"{each!r} is the mode that it leads to: leave it out")


def _check_conditions(root: Section, architecture: Architecture, locations: Mapping[str, Location]) -> None:
    """Note conditions that cannot be, and rules that lead in a circle: where a mode is wrong, that is not known."""
    own = Section(root.node("rules") or Node({}), "rules", root.report)
    for rule in architecture.mode_rules:
        for problem in condition_problems(rule, architecture):
            if rule.name in own:
                own.section(rule.name).wrong("when", problem)
            else:
                root.report.add_at(locations[rule.name], f"rules.{rule.name}", problem)
    if root.report.problems or not architecture.mode_rules:
        return
    changes = {
        name: codec.from_plain({"changes": each}, AdaptationRequest).changes
        for name, each in architecture.modes.items()
    }
    circle = find_circle(architecture, changes)
    if circle is not None:
        last = max(circle.rules, key=[rule.name for rule in architecture.mode_rules].index)
        others = ", ".join(repr(name) for name in circle.rules if name != last)
        why = f"leads in a circle with {others}: " if others else "leads in a circle: "
        location = locations.get(last) or root.report.location_of(f"rules.{last}")
        root.report.add_at(location, f"rules.{last}", f"{why}{circle}; let their conditions exclude each other")
