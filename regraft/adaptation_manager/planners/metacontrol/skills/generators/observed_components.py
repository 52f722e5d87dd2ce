"""The components that an observer monitors, for MROS2's modes observer (paper, section II-B)."""

from __future__ import annotations

from pathlib import Path

from regraft.adaptation_manager.planners.metacontrol.skills.generators.yaml_text import names_below
from regraft.adaptation_manager.planners.metacontrol.skills.meaning import observed
from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import SkillSet


def observed_components(skills: SkillSet) -> str:
    """Return the text of the file."""
    lines = [
        f"# Made from {Path(skills.file).name} by 'regraft skills generate': change that file, not this one.",
        "modes_observer:",
        "  ros__parameters:",
        *names_below("components", observed(skills), "    "),
        "",
    ]
    return "\n".join(lines)
