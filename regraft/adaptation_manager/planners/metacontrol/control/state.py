"""All that a metacontroller knows and has decided; it asks nobody and changes nothing outside."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

from regraft.adaptation_manager.planners.metacontrol.control.deciding import Decided, Known, concluded, planned
from regraft.adaptation_manager.planners.metacontrol.control.groundings import Grounded, Groundings
from regraft.adaptation_manager.planners.metacontrol.control.measurements import Times
from regraft.adaptation_manager.planners.metacontrol.control.modes.designs import Designs
from regraft.adaptation_manager.planners.metacontrol.control.monitor import Monitor
from regraft.adaptation_manager.planners.metacontrol.control.store import ObjectiveStore
from regraft.adaptation_manager.planners.metacontrol.control.translation import Translator
from regraft.adaptation_manager.planners.metacontrol.knowledge.knowledge_base import KnowledgeBase
from regraft.adaptation_manager.planners.metacontrol.knowledge.model import Objective
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import local_name
from regraft.adaptation_manager.planners.metacontrol.reasoning.analysis import Analyser
from regraft.adaptation_manager.planners.metacontrol.reasoning.decisions import Decision
from regraft.adaptation_manager.planners.metacontrol.reasoning.failures import rest_failed
from regraft.adaptation_manager.planners.metacontrol.reasoning.resting import Rest, Resting
from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import SkillSet
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.management.objectives import Attempt
from regraft.bus_schema.model.architecture import Architecture


@dataclass(frozen=True, slots=True)
class Settings:
    """The parameters of a metacontroller that decide: seconds, and the gain for which a design is replaced."""

    times: Times
    margin: float
    first_rest: float
    longest_rest: float
    orphan_after: float


class ControlState:
    """The state of a metacontroller. Times are seconds of the component's clock."""

    def __init__(self, knowledge: KnowledgeBase, skills: SkillSet | None, scope: str) -> None:
        self.analyser = Analyser(knowledge)
        self.model = self.analyser.model
        self.scope = scope
        self.translator = Translator(self.model, skills)
        self.store = ObjectiveStore(self.translator)
        self.monitor = Monitor(self.model, scope, self.translator.contexts())
        self.groundings = Groundings()
        self.resting = Resting()
        self.designs: Designs | None = None
        self.decided: Decided | None = None
        self.decided_at = 0.0
        self._unavailable: dict[str, str] = {}
        self._returned: set[str] = set()
        self.given_up: dict[str, int] = {}
        """Designs that were asked for without an answer, and the revision on which: the request may still wait."""

    # --- memory ---

    def remembered(self) -> dict[str, PlainValue]:
        """Return what a further run has to know, as plain data."""
        return {
            "objectives": self.store.remembered(),
            "groundings": self.groundings.remembered(),
            "monitor": self.monitor.remembered(),
            "resting": [{**asdict(each), "blamed": sorted(each.blamed)} for each in self.resting.every()],
            "given_up": dict(self.given_up),
        }

    def restore(self, remembered: Mapping[str, Any], now: float, settings: Settings) -> list[str]:
        """Continue with what an earlier run knew; returns why some objectives could not be taken."""
        problems = self.store.restore(remembered["objectives"], now)
        self.groundings = Groundings.restored(remembered["groundings"], self.model)
        self.monitor = Monitor(self.model, self.scope, self.translator.contexts(), remembered["monitor"])
        rests = [Rest(**{**each, "blamed": frozenset(each["blamed"])}) for each in remembered["resting"]]
        self.resting = Resting.restored(rests, settings.first_rest, settings.longest_rest)
        given_up = remembered.get("given_up", {})  # an earlier version has none
        self.given_up = {each: on for each, on in given_up.items() if self._is_choice(each)}
        return problems

    def set_rests(self, settings: Settings) -> None:
        """Take over changed times of rest."""
        self.resting = Resting.restored(self.resting.every(), settings.first_rest, settings.longest_rest)

    # --- objectives ---

    def end(self, name: str) -> None:
        """Remove an objective that is over; what provides it stays grounded until the next adaptation."""
        self.store.remove(name)
        self.monitor.forget(name)
        self.resting.forget(name)

    def end_abandoned(self, now: float, settings: Settings) -> list[str]:
        """Remove the objectives whose clients are gone, and return their names."""
        over = self.store.over(now, settings.orphan_after)
        for name in over:
            self.end(name)
        return over

    # --- a cycle ---

    def follow(self, architecture: Architecture, now: float) -> tuple[str, ...]:
        """Take the modes of the stack, and those that others have entered; returns news of designs without a mode."""
        missing: tuple[str, ...] = ()
        if self.designs is None or not self.designs.fits(architecture):
            self.designs = Designs(self.model, architecture, self.scope)
            missing = self.designs.missing()
        self.monitor.see_removed(self.designs.removed(architecture))
        unavailable = self.designs.unavailable(architecture)
        self._returned |= self._unavailable.keys() - unavailable.keys()
        self._unavailable = unavailable
        self.groundings = self.groundings.followed(self.designs, architecture, now)
        return missing

    def decide(self, now: float, settings: Settings, further: Iterable[Objective] = ()) -> Decided:
        """Return what follows from what is known, and a design for each objective, the ``further`` ones included."""
        assert self.designs is not None
        objectives = (*(entry.objective for entry in self.store), *further)
        recovered = self.monitor.recovered
        self.resting.recovered(self.monitor.take_recovered())
        self._returned |= self.resting.recovered(self.monitor.take_back())
        returned = frozenset(self._returned)
        known = Known(
            objectives, self.groundings, self.monitor, self.resting, self.designs, self._unavailable, returned
        )
        situation, analysis, measured = concluded(self.analyser, known, now, settings.times)
        rest_failed(analysis, self.resting, now)
        plan = planned(self.analyser, known, situation, analysis, now, settings.margin)
        return Decided(situation, analysis, plan, measured, recovered, returned)

    def take(self, decided: Decided, now: float) -> None:
        """Note a decision, and the failures because of which designs are left."""
        for decision in decided.plan.decisions:
            state = decided.analysis.objectives.get(decision.objective)
            has_failed = (state is not None and state.is_in_error) or decision.present in self._unavailable
            if decision.present is not None and decision.is_change and has_failed:
                self.note_failure(decision.objective, decision.present, why_left(decision), now)
        self.decided, self.decided_at = decided, now

    def carried_out(
        self, decided: Decided, asked_modes: Mapping[str, str], kept: Iterable[Grounded], now: float
    ) -> None:
        """Note that what was decided is in force, with the groundings that are ``kept``.

        ``asked_modes`` are those that the architecture has now.
        """
        assert self.designs is not None
        before = {each.objective: each.design for each in self.groundings}
        self.groundings = self.groundings.after(decided.plan, kept, now, self.designs, asked_modes)
        for each in self.groundings:
            if before.get(each.objective) != each.design:
                self.monitor.measurements.forget(each.objective)
        self.monitor.decided(decided.recovered)
        self._returned -= decided.returned

    def give_up(self, designs: Iterable[str], revision: int) -> None:
        """Note that nobody answered who was asked for designs; they may still be entered, on that revision alone."""
        self.given_up |= dict.fromkeys(designs, revision)

    def caught_up(self, revision: int) -> None:
        """Forget the designs that were asked for on another revision: by now they were entered, or never will be."""
        self.given_up = {design: on for design, on in self.given_up.items() if on == revision}

    def failed(self, decisions: Iterable[Decision], components: Iterable[str], why: str, now: float) -> None:
        """Let designs rest that could not be put in place."""
        # A component that was down ends the rest when it is back, though the knowledge base may not have it.
        blamed = self.monitor.individuals(components) | (self.monitor.down & set(components))
        for each in decisions:
            if each.design is not None:
                self.resting.add(each.design, each.objective, now, blamed, f"it could not be entered: {why}")
                self.note_failure(each.objective, each.design, why, now)

    def note_failure(self, objective: str, design: str, why: str, now: float) -> None:
        """Remember a failure with the objective of a client that it concerns."""
        given = objective.partition("/")[0]
        if given in self.store:
            self.store[given].note(Attempt(now, local_name(design), why))

    def _is_choice(self, design: str) -> bool:
        return design in self.model.designs and not self.model.designs[design].is_rest


def why_left(decision: Decision) -> str:
    """Return what speaks against the present design."""
    present = next((each for each in decision.assessments if each.design == decision.present), None)
    if present is None:
        return "it is not for the present context"
    return "; ".join(each.why for each in present.against) or "another is better"
