"""Decisions as the bandits take them: the options that a decision allows, and the utility that is measured."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Final

from regraft.adaptation_manager.planners.bandits.credit import Credit, read_credit
from regraft.adaptation_manager.planners.choices.inputs import Asked
from regraft.adaptation_manager.planners.choices.slots import Option
from regraft.adaptation_manager.planners.choices.space import allowed_options
from regraft.adaptation_manager.planners.decisions.deciding import DecisionInputs
from regraft.adaptation_manager.planners.decisions.measuring import Meter, meaning_of
from regraft.adaptation_manager.planners.decisions.model import Decision
from regraft.adaptation_manager.planners.decisions.question import Question
from regraft.bus_schema.annotations import PlainValue

DEFAULT_STRATEGY: Final = "ucb_tuned"


def asked_for(decision: Decision, inputs: DecisionInputs) -> Asked:
    """Return what a request for a decision asks for; its own knobs and settling time come first."""
    knobs = {"low": decision.low, "high": decision.high, **inputs.knobs}
    settle = decision.settle if inputs.settle is None else inputs.settle
    return Asked(inputs.strategy or DEFAULT_STRATEGY, knobs, decision.slots, (), settle, inputs.credit)


def options_in(question: Question, most: int) -> tuple[Option, ...]:
    """Return the options that a decision allows now, those prescribed if there are any; raises BadMessage."""
    rulebook = question.rulebook
    options = allowed_options(question.decision.slots, rulebook.rules, rulebook.texts, most)
    prescribed = [option for option in options if question.prescribes(option.selections)]
    if question.prescribed and not prescribed:
        question.notes.append("the prescribed solution is not possible")
    return tuple(prescribed) or options


@dataclass(slots=True)
class Meters:
    """The measured worth of the present choices, by task."""

    by_task: dict[str, Meter] = field(default_factory=dict)

    def credit(self, task: str) -> tuple[Credit | None, str]:
        """Return the credit of a task's present choice so far, None if nothing was measured, and then why."""
        meter = self.by_task.get(task)
        if meter is None:
            return None, ""
        earned = meter.credit()
        return (read_credit(earned), "") if earned else (None, meter.unknown)

    def end(self, task: str) -> None:
        """Measure a task's present choice no longer."""
        self.by_task.pop(task, None)

    def begin(self, task: str, decision: Decision, option: Option, ticket: str, since: float) -> None:
        """Measure a choice from now on."""
        meaning = meaning_of(decision, option.selections)
        self.by_task[task] = Meter(decision.name, option.selections, meaning, ticket, since)

    def keep_fitting(self, decisions: Mapping[str, Decision]) -> None:
        """Measure on only what still means the same in these decisions."""
        known = self.by_task.items()
        self.by_task = {
            task: meter
            for task, meter in known
            if meter.decision in decisions and meter.fits(decisions[meter.decision])
        }

    def sample(
        self,
        now: float,
        decisions: Mapping[str, Decision],
        situation: Callable[[Decision, float], Mapping[str, Any]],
    ) -> None:
        """Take a sample for each task, in the situation of its decision by what was measured since its change."""
        for meter in self.by_task.values():
            decision = decisions[meter.decision]
            meter.sample(now, decision, situation(decision, meter.since))

    def state(self, task: str) -> PlainValue:
        """Return what was measured of a task's present choice as plain data, None if nothing is."""
        meter = self.by_task.get(task)
        return None if meter is None else {**asdict(meter), "selections": list(meter.selections)}

    def restore(self, task: str, state: PlainValue) -> None:
        """Continue from what ``state`` returned."""
        if state is not None:
            self.by_task[task] = Meter(**{**state, "selections": tuple(state["selections"])})
