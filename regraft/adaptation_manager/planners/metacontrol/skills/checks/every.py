"""All checks of a model, in one pass."""

from __future__ import annotations

from typing import Final

from regraft.adaptation_manager.planners.metacontrol.skills.checks import (
    configurations,
    distinct,
    interfaces,
    name_clashes,
    qualities,
    realizations,
    requirements,
)
from regraft.adaptation_manager.planners.metacontrol.skills.diagnostics import Findings
from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import SkillSet

CHECKS: Final = (name_clashes, interfaces, qualities, configurations, realizations, requirements, distinct)


def check(skills: SkillSet, findings: Findings) -> None:
    """Note everything that is wrong with skills on their own. Each check takes time in proportion to the text."""
    for each in CHECKS:
        each.check(skills, findings)
