"""Saves the knowledge base with what was so when the reasoner failed (MROS2: ``error_reasoning.owl``)."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from regraft.adaptation_manager.planners.metacontrol.control.state import ControlState
from regraft.adaptation_manager.planners.metacontrol.knowledge.errors import KnowledgeError
from regraft.adaptation_manager.planners.metacontrol.knowledge.saving import save
from regraft.adaptation_manager.planners.metacontrol.reasoning.situation import Situation, facts_of
from regraft.run_directory import folder

FILE: Final = "error_reasoning.owl"


def keep_knowledge(state: ControlState, place: str, system: str) -> str:
    """Save the knowledge base, and return where it is or why it could not be saved."""
    path = (Path(place) if place else folder(system)) / FILE
    situation = Situation(
        tuple(entry.objective for entry in state.store),
        state.groundings.facts(),
        state.monitor.statuses(),
        context=state.monitor.context,
    )
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        save(state.analyser.knowledge, path, facts_of(state.model, situation))
    except (KnowledgeError, OSError) as error:
        return f"the knowledge base could not be saved: {error}"
    return f"the knowledge base is in {path}"
