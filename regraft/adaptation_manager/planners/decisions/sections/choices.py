"""The section ``choices``: what is to be chosen, as slots of alternatives."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from regraft.adaptation_manager.planners.choices.settings import Kind, Setting, contradict, identity
from regraft.adaptation_manager.planners.choices.slots import Alternative, Figure, Slot, varied
from regraft.adaptation_manager.planners.decisions.fields import items
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.lifecycle import LASTING, Transition
from regraft.stack.yaml.nodes import plain
from regraft.stack.yaml.section import Section

NAME: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z_][A-Za-z0-9_]*)*")
VARIED: Final = {
    "values": (Kind.PARAMETER, "parameter"),
    "topics": (Kind.PORT, "port"),
    "states": (Kind.STATE, ""),
    "transitions": (Kind.TRANSITION, ""),
    "classes": (Kind.CLASS, ""),
    "hosts": (Kind.HOST, ""),
}
"""The list of a slot that varies one thing, by its kind, and the field that names the thing."""
SET: Final = {
    "value": (Kind.PARAMETER, "parameter"),
    "topic": (Kind.PORT, "port"),
    "state": (Kind.STATE, ""),
    "class": (Kind.CLASS, ""),
    "host": (Kind.HOST, ""),
    "present": (Kind.PRESENCE, ""),
}
STATES: Final = tuple(state.value for state in LASTING)
TRANSITIONS: Final = tuple(each.value for each in Transition if each is not Transition.SHUTDOWN)


@dataclass(slots=True)
class Choices:
    """The slots that could be read, and the names of choices with mistakes, which may lack alternatives or figures."""

    slots: tuple[Slot, ...]
    wrong: frozenset[str]

    @property
    def right(self) -> bool:
        """Whether all choices are known as they were meant."""
        return not self.wrong


def read_choices(document: Section) -> Choices:
    """Return the slots; one that cannot be read is noted and left out."""
    section, problems = document.section("choices"), document.report.problems
    if not section.names():
        document.wrong("choices", "is missing: name at least one thing to choose")
    slots, wrong = [], set()
    for name in section.names():
        before = len(problems)
        slot = _slot(section, name)
        slots += [slot] if slot is not None else []
        wrong |= {name} if len(problems) > before else set()
    return Choices(tuple(slots), frozenset(wrong))


def _slot(table: Section, name: str) -> Slot | None:
    section = table.section(name)
    if not NAME.fullmatch(name):
        table.wrong(name, f"{name!r} must be letters, digits and '_', in parts joined by dots")
        return None
    try:
        slot = _several(section, name) if "alternatives" in section else _varied(section, name)
    except BadMessage as error:
        table.wrong(name, str(error))
        return None
    if slot is not None and not slot.alternatives:
        return None  # which is noted
    if slot is not None and not slot.selections:
        table.wrong(name, "leaves nothing to choose: its alternatives want different values of one thing")
        return None
    return slot


def _varied(section: Section, name: str) -> Slot | None:
    lists = [key for key in VARIED if key in section]
    if len(lists) != 1:
        known = ", ".join(VARIED)
        section.report.add(
            section.path, f"must have 'alternatives', or one of {known}; has {', '.join(lists) or 'none'}"
        )
        return None
    kind, member = VARIED[lists[0]]
    section.only("component", lists[0], *([member] if member else []))
    for needed in ("component", member):
        if needed and needed not in section:
            section.wrong(needed, "is missing")
    values = _values(section, lists[0])
    return varied(section.text("component"), kind, section.text(member) if member else "", values, name)


def _values(section: Section, key: str) -> list[object]:
    node = section.node(key)
    if node is None or not isinstance(node.value, tuple) or not node.value:
        section.wrong(key, "must be a list of at least one")
        return []
    values = [plain(part) for part in node.value]
    allowed = {"states": STATES, "transitions": TRANSITIONS}.get(key)
    for index, value in enumerate(values):
        if identity(value) in map(identity, values[:index]):
            section.wrong(f"{key}.{index}", f"{value!r} is given twice: leave one out")
        elif allowed is not None and value not in allowed:
            section.wrong(f"{key}.{index}", f"{value!r} must be one of: {', '.join(allowed)}")
        elif key != "values" and not isinstance(value, str):
            section.wrong(f"{key}.{index}", f"must be a text, is {value!r}")
    return values


def _several(section: Section, name: str) -> Slot:
    section.only("choose", "alternatives")
    table = section.section("alternatives")
    alternatives = tuple(_alternative(table.section(each), each) for each in table.names())
    if not alternatives:
        section.wrong("alternatives", "must have at least one")
    before: list[Setting] = []
    for each in alternatives:
        if contradict(before, each.otherwise):
            wrong = "sets a thing to another value than the 'otherwise' of an alternative before: leave one out"
            table.wrong(f"{each.name}.otherwise", wrong)
        before += each.otherwise
    least, most = _cardinality(section, len(alternatives))
    return Slot(name, alternatives, least, most)


def _cardinality(section: Section, count: int) -> tuple[int, int]:
    node = section.node("choose")
    given = 1 if node is None else plain(node)
    bounds = [given, given] if isinstance(given, int) else given
    right = isinstance(bounds, list) and len(bounds) == 2 and all(type(each) is int for each in bounds)
    if not right or not 0 <= bounds[0] <= bounds[1] or bounds[1] < 1 or bounds[1] > max(count, 1):
        section.wrong("choose", f"is {given!r}, must be a number, or [least, most], of the {count} alternatives")
        return 1, 1
    return bounds[0], bounds[1]


def _alternative(section: Section, name: str) -> Alternative:
    section.only("set", "otherwise", "figures")
    settings, otherwise = _settings(section, "set"), _settings(section, "otherwise")
    return Alternative(name, settings, _figures(section.section("figures")), otherwise)


def _settings(section: Section, key: str) -> tuple[Setting, ...]:
    table = items(section, key)
    settings: list[Setting] = []
    for each in table.names():
        for setting in _setting(table.section(each)):
            if contradict(settings, [setting]):
                table.wrong(each, "sets a thing that is set before, to another value: leave one out")
            settings.append(setting)
    return tuple(settings)


def _figures(section: Section) -> dict[str, Figure]:
    found: dict[str, Figure] = {}
    for name in section.names():
        number = section.number(name)
        if not NAME.fullmatch(name) or "." in name:
            section.wrong(name, f"{name!r} must be letters, digits and '_'")
        elif number is not None:
            found[name] = number
    return found


def _setting(section: Section) -> Iterator[Setting]:
    kinds = [key for key in SET if key in section]
    if len(kinds) != 1 or "component" not in section:
        known = ", ".join(SET)
        section.report.add(section.path, f"must have 'component' and one of {known}; has {', '.join(section.names())}")
        return
    kind, member = SET[kinds[0]]
    section.only("component", kinds[0], *([member] if member else []))
    if member and member not in section:
        section.wrong(member, "is missing")
        return
    node = section.node(kinds[0])
    value = plain(node) if node else None
    if kind is Kind.STATE and value not in STATES:
        section.wrong("state", f"{value!r} must be one of: {', '.join(STATES)}")
        return
    if kind is Kind.PRESENCE and not isinstance(value, bool | dict):
        section.wrong("present", "must be true, false, or a component as in a stack file")
        return
    if kind in (Kind.PORT, Kind.CLASS, Kind.HOST) and not section.text(kinds[0]):
        return
    yield Setting(section.text("component"), kind, section.text(member) if member else "", value)
