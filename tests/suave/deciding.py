"""SUAVE's knowledge base without a system: what is decided of an observed situation."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path

from regraft.adaptation_manager.planners.metacontrol.control.loading import load_all
from regraft.adaptation_manager.planners.metacontrol.knowledge.model import Grounding, Objective
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import local_name
from regraft.adaptation_manager.planners.metacontrol.knowledge.statuses import ComponentStatus, Status
from regraft.adaptation_manager.planners.metacontrol.reasoning.analysis import Analyser
from regraft.adaptation_manager.planners.metacontrol.reasoning.design_selection import plan
from regraft.adaptation_manager.planners.metacontrol.reasoning.resting import Resting
from regraft.adaptation_manager.planners.metacontrol.reasoning.situation import Situation
from tests.support.paths import SUAVE

SKILLS, RULES = SUAVE / "suave.skills", SUAVE / "water_visibility.owl"
MOTION, SEARCH = "f_maintain_motion", "f_generate_search_path"


@cache
def analyser(skills: Path = SKILLS, rules: Path = RULES) -> Analyser:
    """Return what concludes by SUAVE's knowledge base."""
    return Analyser(load_all(str(skills), str(rules))[0])


def situation(
    motion: str, search: str, visibility: float | None, failed: tuple[str, ...] = (), measured_under: str = MOTION
) -> Situation:
    """Return one in which both functions are provided; the visibility is measured under one of them."""
    model = analyser().model
    groundings = tuple(
        Grounding(f"{function}/grounding", function, model.find("design", design))
        for function, design in ((MOTION, motion), (SEARCH, search))
    )
    quality = model.find("quality", "water_visibility")
    return Situation(
        tuple(
            Objective(name, model.find("function", name), always_improve=name == SEARCH) for name in (MOTION, SEARCH)
        ),
        groundings,
        {model.find("component", name): ComponentStatus.FAILED for name in failed},
        {} if visibility is None else {f"{measured_under}/grounding": {quality: visibility}},
    )


def decided(seen: Situation) -> tuple[dict[str, str | None], Mapping[str, Status]]:
    """Return the design of each function, None for none; and the status of each before the decision."""
    analysis = analyser().analyse(seen)
    found = plan(analyser().model, seen, analysis, Resting(), 0.0)
    designs = {each.objective: local_name(each.design) if each.design else None for each in found.decisions}
    return designs, {name: state.status for name, state in analysis.objectives.items()}
