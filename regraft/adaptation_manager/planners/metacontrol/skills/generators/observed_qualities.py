"""The measured qualities and their expressions, for the observer of qualities: in the layout of the other files."""

from __future__ import annotations

from pathlib import Path

from regraft.adaptation_manager.planners.metacontrol.skills.generators.yaml_text import scalar, word
from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import SkillSet


def observed_qualities(skills: SkillSet) -> str:
    """Return the text of the file."""
    measured = [(each.name, each.measured) for each in skills.qualities if each.measured is not None]
    lines = [
        f"# Made from {Path(skills.file).name} by 'regraft skills generate': change that file, not this one.",
        "quality_observer:",
        "  ros__parameters:",
        f"    qualities:{'' if measured else ' {}'}",
        *(f"      {word(name)}: {scalar(expression)}" for name, expression in measured),
        "",
    ]
    return "\n".join(lines)
