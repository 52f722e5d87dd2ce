"""Loads what a metacontroller decides by: skills, and the knowledge base made of them or of files."""

from __future__ import annotations

from pathlib import Path

from regraft.adaptation_manager.planners.metacontrol.control.modes.designs import Designs
from regraft.adaptation_manager.planners.metacontrol.knowledge.errors import KnowledgeError, fail
from regraft.adaptation_manager.planners.metacontrol.knowledge.knowledge_base import KnowledgeBase, load
from regraft.adaptation_manager.planners.metacontrol.knowledge.view import model_of
from regraft.adaptation_manager.planners.metacontrol.skills.diagnostics import Severity
from regraft.adaptation_manager.planners.metacontrol.skills.knowledge import knowledge_of
from regraft.adaptation_manager.planners.metacontrol.skills.reading import checked_skills, read_skills
from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import SkillSet
from regraft.bus_schema.model.architecture import Architecture


def load_all(skills: str, knowledge: str) -> tuple[KnowledgeBase, SkillSet | None]:
    """Return the knowledge base, and the skills if a file of them is given; raises SkillsError and KnowledgeError."""
    read = read_skills(Path(skills)) if skills else None
    return _knowledge_of(read, knowledge), read


def problems_in(skills: str, knowledge: str, architecture: Architecture, scope: str) -> list[tuple[str, str]]:
    """Return what is wrong with skills and knowledge in a stack: the parameter at fault, and why."""
    read = None
    if skills:
        checked = checked_skills(Path(skills), architecture, scope)
        wrong = [("skills", str(each)) for each in checked.diagnostics if each.severity is Severity.ERROR]
        if wrong:
            return wrong
        read = checked.skills
    where = "knowledge" if knowledge else "skills"
    try:
        model = model_of(_knowledge_of(read, knowledge))
    except KnowledgeError as error:
        return [(where, str(each)) for each in error.problems]
    return [(where, each) for each in Designs(model, architecture, scope).missing()]


def _knowledge_of(skills: SkillSet | None, place: str) -> KnowledgeBase:
    """Return the base of skills, and of further OWL files of their domain; raises KnowledgeError.

    The files of a folder are taken in the order of their names.
    """
    files = _owl_files(Path(place)) if place else []
    return load(files) if skills is None else knowledge_of(skills, files)


def _owl_files(place: Path) -> list[Path]:
    if not place.is_dir():
        return [place]
    found = sorted(place.glob("*.owl"))
    if not found:
        raise fail(str(place), 0, "holds no knowledge base: must have at least one .owl file")
    return found
