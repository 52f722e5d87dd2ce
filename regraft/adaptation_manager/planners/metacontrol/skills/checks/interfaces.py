"""Inputs, outputs and results of skills."""

from __future__ import annotations

import math
from typing import Final

from regraft.adaptation_manager.planners.metacontrol.skills.diagnostics import Code, Findings
from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import SkillSet
from regraft.bus_schema.encoding.registry import known_types
from regraft.bus_schema.encoding.topic_types import know_schema
from regraft.bus_schema.suggestions import Hints

TYPES: Final = ("bool", "int", "float", "string", "PoseStamped")
"""The types of the published grammar."""


def type_names() -> tuple[str, ...]:
    """Return the types that inputs and outputs may have: the published ones, then message types."""
    know_schema()
    return (*TYPES, *sorted(each.name for each in known_types()))


def check(skills: SkillSet, findings: Findings) -> None:
    """Note types that are neither published nor message types, and results whose number is none."""
    known = frozenset(type_names())
    hints = Hints(known)
    by_own_name = {name.rpartition("/")[2].lower(): name for name in sorted(known, reverse=True)}
    for skill in skills.skills:
        for each in (*skill.inputs, *skill.outputs):
            if each.type not in known:
                meant = by_own_name.get(each.type.rpartition("/")[2].lower())
                hint = f"did you mean {meant!r}?" if meant else hints.instead_of(each.type)
                problem = f"{each.name}: there is no type {each.type!r}; {hint}"
                findings.error(each.place, Code.UNKNOWN_TYPE, problem)
        for result in skill.results:
            if result.number is not None and not math.isfinite(result.number):
                problem = f"the number of {result.kind.value!r} is out of range: it goes to about 1.8e308"
                findings.error(result.place, Code.BAD_NUMBER, problem)
