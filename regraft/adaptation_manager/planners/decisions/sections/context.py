"""The section ``context``: what is known of the world when a planner decides."""

from __future__ import annotations

import re
from typing import Final

from regraft.adaptation_manager.planners.decisions.model import ContextEntry
from regraft.bus_schema.encoding.reading import Reading, Reduce
from regraft.stack.yaml.section import Section

NAME: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
OF_TOPICS: Final = ("topic", "field", "reduce", "at_least", "if_none", "stale_after")
SOURCES: Final = ("topic", "requirement", "fault", "request")


def read_context(document: Section) -> tuple[ContextEntry, ...]:
    """Return the entries of the context."""
    section = document.section("context")
    found = []
    for name in section.names():
        if not NAME.fullmatch(name):
            section.wrong(name, f"{name!r} must be a letter or '_', then letters, digits and '_'")
        else:
            found.append(_entry(section.section(name), name))
    return tuple(found)


def _entry(section: Section, name: str) -> ContextEntry:
    given = [source for source in SOURCES if source in section]
    if len(given) != 1:
        section.report.add(section.path, f"must have one of {', '.join(SOURCES)}; has {' and '.join(given) or 'none'}")
        return ContextEntry(name)
    if given == ["topic"]:
        section.only(*OF_TOPICS)
        stale_after = section.number("stale_after", minimum=0.0)
        if stale_after == 0.0:
            section.wrong("stale_after", "0: must be greater than 0, or nothing is ever known")
        return ContextEntry(name, section.text("topic"), _reading(section), stale_after)
    if given == ["request"]:
        section.only("request")
        return ContextEntry(name, request=section.text("request"))
    section.only(given[0])
    if given == ["requirement"]:
        return ContextEntry(name, requirement=section.text("requirement"))
    return ContextEntry(name, component=section.text("fault"))


def _reading(section: Section) -> Reading:
    if "field" not in section:
        section.wrong("field", "is missing: the dotted path of a field of the topic's messages")
    chosen = section.choice("reduce", Reduce, Reduce.ABS) if "reduce" in section else None
    if "at_least" in section and chosen not in (Reduce.MIN, Reduce.MAX, Reduce.MEAN):
        section.wrong("at_least", "is for reduce: min, max and mean")
    return Reading(section.text("field"), chosen, section.number("at_least"), section.number("if_none"))
