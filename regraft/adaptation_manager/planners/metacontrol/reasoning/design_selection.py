"""The plan step: a design for each objective, decided together by priority. It is a function of its arguments.

Candidates are the designs of the current context that are realisable, do not rest and have not failed. Their estimates
meet every requirement. The one with the highest utility is selected; of equal ones the present design,
then the first in the files. A design that would change what another objective holds is left to a later try.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from typing import Final, TypeAlias

from regraft.adaptation_manager.planners.metacontrol.knowledge.model import (
    Design,
    Model,
    Objective,
    objective_problems,
)
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import local_name
from regraft.adaptation_manager.planners.metacontrol.knowledge.statuses import Status
from regraft.adaptation_manager.planners.metacontrol.reasoning.analysis import Analysis, ObjectiveState
from regraft.adaptation_manager.planners.metacontrol.reasoning.assessment import (
    Against,
    Objection,
)
from regraft.adaptation_manager.planners.metacontrol.reasoning.considering import Considered
from regraft.adaptation_manager.planners.metacontrol.reasoning.decisions import Decision, Plan, status_without_design
from regraft.adaptation_manager.planners.metacontrol.reasoning.ranking import Rankings
from regraft.adaptation_manager.planners.metacontrol.reasoning.resting import Rest, Resting
from regraft.adaptation_manager.planners.metacontrol.reasoning.situation import (
    MAX_NESTING,
    Situation,
    required_objectives,
)

MARGIN: Final = 0.05
"""How much better a design must be to replace one that is without errors."""

MAX_TRIES: Final = 10_000
"""Designs that one decision tries at the most. Each objective has its share, and what those before it have left."""
MAX_REASON: Final = 300
"""Characters of the reason why a requirement has no design, which holds the reasons of its own requirements."""

NOTHING: Final[Mapping[str, str]] = {}

Clash: TypeAlias = Callable[[str, str], str]
"""Returns why two designs exclude each other, empty if they do not."""


def no_clash(one: str, other: str) -> str:
    """Return that designs do not exclude each other."""
    return ""


def plan(
    model: Model,
    situation: Situation,
    analysis: Analysis,
    resting: Resting,
    now: float,
    *,
    clash: Clash = no_clash,
    margin: float = MARGIN,
    unavailable: Mapping[str, str] = NOTHING,
    returned: Collection[str] = (),
) -> Plan:
    """Return a decision for each objective, and for those that selected designs require.

    ``now`` is the time of the clock that ``resting`` has. An objective that must be refused has the reasons, and no
    design. The system cannot enter designs that are ``unavailable``, for the reasons given. Objectives are
    reconsidered for those that have ``returned``.
    """
    rankings = analysis.rankings if analysis.rankings.model is model else Rankings(model)
    planner = _Planner(
        model, situation, analysis, rankings, resting.all(now), now, clash, margin, unavailable, returned
    )
    order = sorted(enumerate(situation.objectives), key=lambda each: (-each[1].priority, each[0]))
    for place, (_, objective) in enumerate(order, 1):
        planner.limit = MAX_TRIES * place // len(order)
        planner.decide(objective, ())
    return Plan(tuple(planner.decisions))


@dataclass(slots=True)
class _Planner:
    """Decides objective by objective; ``held`` are the designs that are taken, with their objectives."""

    model: Model
    situation: Situation
    analysis: Analysis
    rankings: Rankings
    rests: tuple[Rest, ...]
    now: float
    clash: Clash
    margin: float
    unavailable: Mapping[str, str]
    returned: Collection[str]
    held: list[tuple[str, str]] = field(default_factory=list)
    decisions: list[Decision] = field(default_factory=list)
    tries: int = 0
    limit: int = MAX_TRIES

    def decide(self, objective: Objective, path: tuple[str, ...], parent: str = "") -> bool:
        """Decide an objective and what its design requires; return whether it has a design."""
        problems = objective_problems(self.model, objective)
        if problems:
            self.decisions.append(Decision(objective.name, parent, None, None, Status.UNGROUNDED, refused=problems))
            return False
        state = self.analysis.objectives.get(objective.name, ObjectiveState(Status.UNGROUNDED))
        considered = self._considered(objective)
        present = considered.present
        place = len(self.decisions)
        for name in self._ordered(objective, state, considered):
            objection = self._try(objective, name, path)
            if objection is None:
                considered.selected = name
                decision = Decision(objective.name, parent, present, name, Status.IN_PROGRESS, considered)
                self.decisions.insert(place, decision)
                return True
            considered.tried[name] = objection
        status = status_without_design(state.status, considered.kinds(), considered.required_statuses())
        self.decisions.append(Decision(objective.name, parent, present, None, status, considered))
        return False

    def _considered(self, objective: Objective) -> Considered:
        grounding = self.situation.grounding_of(objective.name)
        rests = {each.design: each for each in self.rests if each.objective == objective.name}
        return Considered(
            objective,
            self.rankings.of(objective, self.situation.context),
            self.model.qualities,
            self.analysis,
            rests,
            self.now,
            grounding.design if grounding is not None else None,
            self.unavailable,
        )

    def _ordered(self, objective: Objective, state: ObjectiveState, considered: Considered) -> list[str]:
        """Return the candidates, the one to try first at the beginning."""
        ordered, present = considered.candidates(), considered.present
        if present is None:
            return _with_first(ordered, objective.design)
        reconsidered = state.is_in_error or state.updatable or any(name in self.returned for name in ordered)
        keeps = not (reconsidered or objective.always_improve)
        improves = objective.always_improve and not reconsidered
        if present in ordered and improves:
            utilities = considered.ranking.utilities
            keeps = utilities[ordered[0]] - utilities[present] <= self.margin
        return _with_first(ordered, present) if keeps else ordered

    def _try(self, objective: Objective, name: str, path: tuple[str, ...]) -> Objection | None:
        """Take a design and what it requires; return why that is not possible, with nothing taken."""
        design = self.model.designs[name]
        if self.tries >= self.limit:
            return Objection(Against.REQUIRED, f"the search was given up after {self.limit} designs")
        self.tries += 1
        for holder, other in self.held:
            why = self.clash(name, other)
            if why:
                return Objection(Against.CLASH, f"{why}, which {local_name(holder)} holds", holder)
        if objective.function in path or len(path) >= MAX_NESTING:
            functions = " -> ".join(local_name(each) for each in (*path, objective.function))
            return Objection(Against.CIRCULAR, f"its function requires itself: {functions}")
        held, decisions = len(self.held), len(self.decisions)
        self.held.append((objective.name, name))
        objection = self._require(objective, design, (*path, objective.function))
        if objection is not None:
            del self.held[held:]
            del self.decisions[decisions:]
        return objection

    def _require(self, objective: Objective, design: Design, path: tuple[str, ...]) -> Objection | None:
        for required in required_objectives(objective, design):
            if not self.decide(required, path, objective.name):
                failed = next(each for each in reversed(self.decisions) if each.objective == required.name)
                return _requiring(local_name(required.function), failed)
        return None


def _requiring(function: str, failed: Decision) -> Objection:
    why = f"it requires {function}, which has no design"
    return Objection(Against.REQUIRED, lambda: f"{why}: {failed.why_within(MAX_REASON)}", status=failed.status)


def _with_first(ordered: list[str], first: str | None) -> list[str]:
    return [first, *(name for name in ordered if name != first)] if first in ordered and first else ordered
