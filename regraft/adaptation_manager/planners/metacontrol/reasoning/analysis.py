"""The analyse step: the status of each objective, and the designs that are not realisable, each with its reason.

All conclusions are drawn from the facts of one cycle. A component that has recovered is therefore no longer held
against a design, without anything to reset.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from regraft.adaptation_manager.planners.metacontrol.knowledge import vocabulary
from regraft.adaptation_manager.planners.metacontrol.knowledge.knowledge_base import KnowledgeBase
from regraft.adaptation_manager.planners.metacontrol.knowledge.model import Model
from regraft.adaptation_manager.planners.metacontrol.knowledge.owl.axioms import relevant_axioms
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.chainer import Conclusions, Program
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.conflicts import added_conflicts, conflicts
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.explanation import Reason, explain
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import Data, Fact, Term, truth
from regraft.adaptation_manager.planners.metacontrol.knowledge.statuses import Status
from regraft.adaptation_manager.planners.metacontrol.knowledge.view import model_of
from regraft.adaptation_manager.planners.metacontrol.reasoning.ranking import Rankings
from regraft.adaptation_manager.planners.metacontrol.reasoning.situation import (
    Situation,
    active_objectives,
    facts_of,
)

RUN_TIME: Final = frozenset(
    {
        vocabulary.C_STATUS,
        vocabulary.FG_STATUS,
        vocabulary.FG_ERROR,
        vocabulary.O_STATUS,
        vocabulary.UPDATABLE,
        vocabulary.ERROR_LOG,
        vocabulary.TYPE_F,
        vocabulary.HAS_NFR,
        vocabulary.TYPE_FD,
        vocabulary.SOLVES_O,
        vocabulary.REQUIRES_O,
        vocabulary.HAS_MEASUREMENT,
    }
)
"""Properties whose facts come from the situation: those of the files are its beginning (``initial_situation``)."""

GRAVITY: Final = (Status.IN_ERROR_COMPONENT, Status.IN_ERROR_FR, Status.IN_ERROR_NFR)
"""Errors from the gravest on: where several hold, the first is the status."""

UNREALISABLE: Final = truth(False)


@dataclass(frozen=True, slots=True)
class ObjectiveState:
    """The status of an objective. ``errors`` are all that hold, the gravest first."""

    status: Status
    errors: tuple[Status, ...] = ()
    updatable: bool = False

    @property
    def is_in_error(self) -> bool:
        """Return whether the objective is grounded, and its grounding in error."""
        return bool(self.errors)


@dataclass(frozen=True, slots=True)
class Analysis:
    """The conclusions from a situation.

    ``failed`` are designs and the objectives that they failed to solve. ``conflicts`` are conclusions that contradict
    each other, as text. ``rankings`` are those of the model, which do not depend on the situation.
    """

    objectives: Mapping[str, ObjectiveState]
    unrealisable: frozenset[str]
    failed: tuple[tuple[str, str], ...]
    conflicts: tuple[str, ...]
    conclusions: Conclusions
    rankings: Rankings = field(repr=False, compare=False)

    def why_unrealisable(self, design: str) -> Reason | None:
        """Return why a design is not realisable, None if it is."""
        return explain(self.conclusions, (vocabulary.REALISABILITY, design, UNREALISABLE))

    def why_failed(self, design: str, objective: str) -> Reason | None:
        """Return why a design has failed for an objective, None if it has not."""
        return explain(self.conclusions, (vocabulary.ERROR_LOG, design, objective))

    def why_in_error(self, objective: str) -> tuple[Reason, ...]:
        """Return why an objective is in error: a reason for each error."""
        state = self.objectives.get(objective)
        facts: list[Fact] = [
            (vocabulary.O_STATUS, objective, Data("text", str(error))) for error in (state.errors if state else ())
        ]
        reasons = (explain(self.conclusions, fact) for fact in facts)
        return tuple(reason for reason in reasons if reason is not None)

    def why_updatable(self, objective: str) -> Reason | None:
        """Return why an objective can be updated, None if it cannot."""
        return explain(self.conclusions, (vocabulary.UPDATABLE, objective, truth(True)))


class Analyser:
    """Analyses situations by the rules of a knowledge base; raises KnowledgeError for one without a meaning."""

    def __init__(self, knowledge: KnowledgeBase) -> None:
        self.knowledge = knowledge
        self.model: Model = model_of(knowledge)
        self.rankings = Rankings(self.model)
        # The types that axioms give to what is stated were checked when the files were loaded.
        program = Program((*relevant_axioms(knowledge.axioms, knowledge.rules), *knowledge.rules))
        self._base = program.over(fact for fact in knowledge.facts if fact[0] not in RUN_TIME)
        functional = knowledge.axioms.functional
        self._lasting_conflicts = conflicts(self._base.conclude(), functional)

    def analyse(self, situation: Situation) -> Analysis:
        """Return what follows from a situation; raises TooManyFacts where rules have no end."""
        conclusions = self._base.conclude(facts_of(self.model, situation))
        added = added_conflicts(conclusions, self.knowledge.axioms.functional)
        statuses: dict[Term, set[Term]] = {}
        for fact in conclusions.of(vocabulary.O_STATUS):
            statuses.setdefault(fact[1], set()).add(fact[-1])
        updatable = {fact[1] for fact in conclusions.of(vocabulary.UPDATABLE) if fact[-1] == truth(True)}
        objectives = {
            name: _state(statuses.get(name, set()), name in updatable, situation.grounding_of(name) is not None)
            for name in active_objectives(self.model, situation)
        }
        return Analysis(
            objectives,
            frozenset(str(fact[1]) for fact in conclusions.of(vocabulary.REALISABILITY) if fact[-1] == UNREALISABLE),
            tuple((str(fact[1]), str(fact[-1])) for fact in conclusions.of(vocabulary.ERROR_LOG)),
            tuple(each.text(conclusions) for each in (*self._lasting_conflicts, *added)),
            conclusions,
            self.rankings,
        )


def _state(statuses: set[Term], updatable: bool, is_grounded: bool) -> ObjectiveState:
    if not is_grounded:
        return ObjectiveState(Status.UNGROUNDED, (), updatable)
    values = {status.value for status in statuses if isinstance(status, Data)}
    errors = tuple(status for status in GRAVITY if status.value in values)
    return ObjectiveState(errors[0] if errors else Status.IN_PROGRESS, errors, updatable)
