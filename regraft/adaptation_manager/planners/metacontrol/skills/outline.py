"""The outline of a file for people and editors: skills, realizations, components, configurations."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from regraft.adaptation_manager.planners.metacontrol.skills.meaning import is_rest
from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import Component, Place, Realization, SkillSet


@dataclass(frozen=True, slots=True)
class Entry:
    """An entry of the outline; ``detail`` is what is worth knowing next to its name."""

    kind: str
    name: str
    place: Place
    detail: str = ""
    below: tuple[Entry, ...] = ()


def outline_of(skills: SkillSet) -> tuple[Entry, ...]:
    """Return the outline of a file with its imports: qualities, components on their own, then skills."""
    qualities = [Entry("quality", each.name, each.place, f"{each.better.value} is better") for each in skills.qualities]
    components = [_component(each) for each in skills.components]
    found: dict[str, list[Entry]] = {each.name: [] for each in skills.skills}
    alone: list[Entry] = []
    for realization in skills.realizations:
        found.get(realization.skill, alone).append(_realization(realization))
    listed = {each.name: ", ".join(name.text for name in each.qualities) for each in skills.skills}
    of_skills = [
        Entry("skill", each.name, each.place, listed[each.name], tuple(found.pop(each.name, ())))
        for each in skills.skills
    ]
    return (*qualities, *components, *of_skills, *alone)


def outline_lines(entries: Iterable[Entry], indent: str = "") -> Iterator[str]:
    """Yield the outline as indented lines."""
    for each in entries:
        detail = f" ({each.detail})" if each.detail else ""
        yield f"{indent}{each.kind} {each.name}{detail}"
        yield from outline_lines(each.below, f"{indent}  ")


def outline_plain(entries: Iterable[Entry]) -> list[dict[str, Any]]:
    """Return the outline as plain data."""
    return [
        {
            "kind": each.kind,
            "name": each.name,
            "detail": each.detail,
            **plain_place(each.place),
            "children": outline_plain(each.below),
        }
        for each in entries
    ]


def plain_place(place: Place) -> dict[str, Any]:
    """Return a place as plain data; lines and columns count from 1."""
    return {
        "file": place.file,
        "line": place.line,
        "column": place.column,
        "end_line": place.end_line,
        "end_column": place.end_column,
    }


def _realization(realization: Realization) -> Entry:
    estimates = ", ".join(f"{each.quality} {each.value:g}" for each in realization.estimates)
    detail = "rest" if is_rest(realization) else estimates
    shown = ", ".join(part for part in (realization.context.text, detail) if part)
    below = tuple(map(_component, realization.components))
    return Entry("realization", realization.name, realization.place, shown, below)


def _component(component: Component) -> Entry:
    below = tuple(
        Entry("configuration", each.name, each.place, ", ".join(one.name for one in each.parameters or ()))
        for each in component.configurations
    )
    return Entry("component", component.name, component.place, "observable" if component.observable else "", below)
