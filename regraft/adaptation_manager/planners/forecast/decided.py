"""Decisions as the forecast takes them: by a solver, among all that is allowed, by what is expected."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

from regraft.adaptation_manager.planners.choices.estimates import Estimator
from regraft.adaptation_manager.planners.choices.slots import Option
from regraft.adaptation_manager.planners.choices.solvers.named import solver_named
from regraft.adaptation_manager.planners.choices.solvers.protocol import Effort, Solver
from regraft.adaptation_manager.planners.decisions.checking import not_predicted
from regraft.adaptation_manager.planners.decisions.deciding import read_decision_inputs
from regraft.adaptation_manager.planners.decisions.model import Decision
from regraft.adaptation_manager.planners.decisions.question import question_of
from regraft.adaptation_manager.planners.decisions.showing import choice_plain, shown
from regraft.adaptation_manager.planners.decisions.standing import Standing
from regraft.bus_schema.annotations import Count, PlainValue, Seconds
from regraft.bus_schema.encoding.records import record_shape
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.architecture import Architecture

STRATEGY: Final = "expected_utility"


@dataclass(frozen=True, slots=True)
class SolverKnobs:
    """How the best is searched for: by which solver, and how long at most.

    ``steps`` are repeatable; a ``deadline`` (s of the wall clock) is not.
    """

    solver: str = "branch_and_bound"
    steps: Count | None = None
    deadline: Seconds | None = None


@dataclass(frozen=True, slots=True)
class Decided:
    """A decision, and how it is to be searched."""

    decision: Decision
    solver: Solver
    effort: Effort

    def choose(
        self, architecture: Architecture, situation: Mapping[str, Any], estimates: Estimator, standing: Standing
    ) -> tuple[Option | None, dict[str, PlainValue]]:
        """Return the option that is expected to be best, None if nothing can be expected, and the explanation.

        Raises:
            BadMessage: the decision ties too much together.
            CannotSolve: the solver cannot take it on.
        """
        question = question_of(self.decision, situation, estimates, standing)
        choice = question.choose(architecture, self.solver, self.effort)
        told = choice_plain(self.decision, question, choice)
        if choice.option is None:
            why = f"nothing is chosen: {choice.explanation.nothing}"
        else:
            best = [f"{', '.join(map(str, each.values))}: {each.utility:.4g}" for each in choice.explanation.runners_up]
            chosen = shown([s.name for s in self.decision.slots], choice.option.values)
            why = f"prescribed: {chosen}" if choice.utility is None else f"expected {choice.utility:.4g} of {chosen}"
            why += f" ({'; '.join(best)})" if best else ""
        return choice.option, {"strategy": STRATEGY, "decision": self.decision.name, "why": why, **told}


def read_decided(plain: dict[str, PlainValue], named: Callable[[str], Decision]) -> Decided | None:
    """Return the decision that a request names, None if it names none; raises BadMessage."""
    if "decision" not in plain:
        return None
    inputs = read_decision_inputs(plain)
    if inputs.strategy not in ("", STRATEGY):
        raise BadMessage(f"there is no strategy {inputs.strategy!r}; there is: {STRATEGY}", ("strategy",))
    decision = named(inputs.decision)
    used = set(decision.utility.names)
    for each in not_predicted(decision):
        if each.field.removeprefix("qualities.") in used:
            raise BadMessage(f"{decision.name}: {each.field} {each.why}", ("decision",))
    try:
        knobs: SolverKnobs = record_shape(SolverKnobs).unpack(inputs.knobs)
        return Decided(decision, solver_named(knobs.solver), Effort(knobs.steps, knobs.deadline))
    except BadMessage as error:
        raise error.inside("knobs") from None
