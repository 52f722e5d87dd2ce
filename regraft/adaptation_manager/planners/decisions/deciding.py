"""The base of planners that take decisions from files, asked or by themselves."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final

from regraft import CallFailed, Component, Input, Parameter, RequestRefused
from regraft.adaptation_manager.planners.choices.context import numbers_of
from regraft.adaptation_manager.planners.choices.estimates import Estimator
from regraft.adaptation_manager.planners.choices.fitting import misfits
from regraft.adaptation_manager.planners.decisions.checking import check_in
from regraft.adaptation_manager.planners.decisions.measurements import MeasuredSituation, measurements_for
from regraft.adaptation_manager.planners.decisions.model import Decision
from regraft.adaptation_manager.planners.decisions.reading import locations_in, read_decision
from regraft.adaptation_manager.planners.decisions.scoping import estimates_in, in_scope
from regraft.adaptation_manager.planners.decisions.situation import inputs_for, situation
from regraft.adaptation_manager.planners.decisions.standing import Standing, standing_of
from regraft.adaptation_manager.planners.decisions.watching import Watch
from regraft.adaptation_manager.planners.manager_client import CarriedOut
from regraft.bus_schema.annotations import Bounds, PlainValue, Seconds, Text
from regraft.bus_schema.encoding.records import record_shape
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.planning import Proposal, ProposalRequest
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.robots.scopes import scope_of
from regraft.bus_schema.suggestions import no_such
from regraft.component.parameters import ParameterError
from regraft.stack import StackError
from regraft.stack.yaml.problems import fail

MAX_TOLD: Final = 5
"""Problems that a refusal names."""

Name = Annotated[str, Text(200)]


@dataclass(frozen=True, slots=True)
class DecisionInputs:
    """The inputs of a request that names a decision; what is left out is the planner's, or the decision's own."""

    decision: Name
    strategy: Name = ""
    knobs: dict[str, PlainValue] = field(default_factory=dict)
    settle: Annotated[Seconds, Bounds(0.0, 3600.0)] | None = None
    credit: dict[str, PlainValue] | None = None


def read_decision_inputs(plain: dict[str, PlainValue]) -> DecisionInputs:
    """Return the inputs; raises BadMessage naming what is wrong, and where."""
    if "options" in plain:
        raise BadMessage("is given next to 'decision', which has its own: give one of them", ("options",))
    inputs: DecisionInputs = record_shape(DecisionInputs).unpack(plain)
    return inputs


def decisions_at(place: str) -> dict[str, Decision]:
    """Return the decisions of a file, or of all YAML files of a folder, by name; raises StackError."""
    if not place:
        return {}
    path = Path(place)
    files = sorted(path.glob("*.yaml")) if path.is_dir() else [path]
    if not files:
        fail(place, None, "holds no decision: must have at least one .yaml file")
    return {file.stem: read_decision(file) for file in files}


def check_fits(decision: Decision, architecture: Architecture) -> None:
    """Raise BadMessage for what of a decision cannot be in an architecture."""
    wrong = [f"choice {decision.slots[each.slot].name}: {each.why}" for each in misfits(decision.slots, architecture)]
    if wrong:
        unique = list(dict.fromkeys(wrong))
        more = [f"and {len(unique) - MAX_TOLD} more"] if len(unique) > MAX_TOLD else []
        raise BadMessage("; ".join([*unique[:MAX_TOLD], *more]), ("decision",))


class DecidingPlanner(Component):
    """Takes the decisions that files describe: whenever it is asked, and by itself at their triggers."""

    cannot_express: ClassVar[str]
    """The parts of decisions that this kind of planner does not use, for people."""

    decisions = Parameter("", "a decision file, or a folder of them", unit="path", read_only=True)

    @classmethod
    def ports_for(cls, parameters: dict[str, Any]) -> Iterable[Input[Any]]:
        """Name the inputs that the decisions' context is read from."""
        try:
            return list(inputs_for(decisions_at(parameters["decisions"]).values()))
        except StackError as error:
            raise ParameterError([("decisions", str(error))]) from None

    @classmethod
    def check_architecture(cls, name: str, parameters: dict[str, Any], architecture: Architecture) -> None:
        """Find what of the decisions cannot be in the stack, by the files' own lines."""
        scope = scope_of(name, architecture.scopes)
        estimates = estimates_in(architecture, scope)
        wrong: list[tuple[str, str]] = []
        for decision in decisions_at(parameters["decisions"]).values():
            report = locations_in(Path(decision.file))
            check_in(in_scope(decision, scope), architecture, estimates, report, scope)
            wrong += [("decisions", str(problem)) for problem in report.problems]
        if wrong:
            raise ParameterError(wrong)

    @abstractmethod
    async def decide(self, request: ProposalRequest) -> Proposal:
        """Answer a request; raises RequestRefused."""

    def begin_deciding(self) -> None:
        """Read the decisions, and begin to take those by itself that have triggers."""
        found = decisions_at(self.decisions)
        self._effect_since: dict[str, float] = {}
        self.known_decisions = {name: in_scope(decision, self.kit.scope) for name, decision in found.items()}
        for decision in self.known_decisions.values():
            if decision.triggers.are_given:
                self.kit.spawn(self._watch(decision), f"watching for {decision.name}")

    def schema_with_decisions(self, listed: dict[str, Any]) -> dict[str, Any]:
        """Return the JSON Schema of the inputs: those that list options, and those that name a decision."""
        if not self.known_decisions:
            return listed
        named = record_shape(DecisionInputs).json_schema()
        named["description"] = f"A decision that a file describes. It cannot express: {self.cannot_express}."
        measured = [f"{name} by {', '.join(each)}" for name, each in self._measured_by().items()]
        if measured:
            named["description"] += f" It measures {'; '.join(measured)}."
        named["properties"]["decision"] = {"enum": list(self.known_decisions)}
        return {"type": "object", "anyOf": [listed, named]}

    def _measured_by(self) -> dict[str, tuple[str, ...]]:
        """Return the qualities of components by which each decision's qualities are measured."""
        pairs = ((decision, quality) for decision in self.known_decisions.values() for quality in decision.qualities)
        found = {f"{decision.name}.{q.name}": decision.measured_names(q) for decision, q in pairs}
        return {name: names for name, names in found.items() if names}

    def decision_named(self, name: str) -> Decision:
        """Return a decision; raises BadMessage."""
        if name not in self.known_decisions:
            raise BadMessage(no_such("decision", name, self.known_decisions), ("decision",))
        return self.known_decisions[name]

    def situation(self, decision: Decision, request: ProposalRequest | None = None) -> dict[str, Any]:
        """Return what is known: the request's context, and the decision's own, which takes precedence."""
        context = request.context if request else {}
        texts = {name: value for name, value in context.items() if isinstance(value, str)}
        told = {**texts, **numbers_of(context)}
        return {**told, **situation(decision, self.kit, told)}

    def estimates(self, architecture: Architecture) -> Estimator:
        """Return where the estimates come from that decisions speak of."""
        return estimates_in(architecture, self.kit.scope)

    # --- what is measured ---

    def note_change(self, decision: Decision, effect_since: float) -> None:
        """Take the time from which on a change for a decision shows its effect: what was measured before does not."""
        self._effect_since[decision.name] = effect_since

    def standing(self, decision: Decision, situation: Mapping[str, Any], architecture: Architecture) -> Standing:
        """Return what is measured now of what stands."""
        since = self._effect_since.get(decision.name, -math.inf)
        measurements = measurements_for(decision, self.kit, since)
        return standing_of(decision, situation, measurements, architecture, self.kit.scope)

    def measured_situation(self, decision: Decision, since: float) -> MeasuredSituation:
        """Return what is known, with the qualities that components have measured after ``since``."""
        return MeasuredSituation(self.situation(decision), measurements_for(decision, self.kit, since))

    def in_context(
        self, request: ProposalRequest, decision: Decision, situation: dict[str, Any], standing: Standing
    ) -> ProposalRequest:
        """Return a request whose context, which the journal keeps, has what the decision was taken by too."""
        own = {entry.name: situation[entry.name] for entry in decision.context if entry.name in situation}
        measured = {name: each["value"] for name, each in standing.plain().items()}
        return replace(request, context={**request.context, **own, **({"measured": measured} if measured else {})})

    async def _watch(self, decision: Decision) -> None:
        watch = Watch(decision, self.kit.now())
        complained = ""
        while True:
            reasons = watch.reasons(self.kit.now(), self.situation(decision))
            if not reasons:
                await watch.pause(self.kit)
                continue
            request = ProposalRequest(decision.name, "; ".join(reasons), inputs={"decision": decision.name})
            problem = await self._problem(request)
            watch.decided(self.kit.now(), taken=not problem)
            if problem and problem != complained:
                self.kit.event("planner.undecided", f"decision {decision.name}: {problem}")
            complained = problem

    async def _problem(self, request: ProposalRequest) -> str:
        """Take a decision, and have it carried out; return why that has not come about, nothing if it has."""
        try:
            proposal = await self.decide(request)
        except (RequestRefused, CallFailed) as error:
            return str(error)
        choice = proposal.choice
        if choice["option"] is None:
            return str(choice["why"])
        notes = "; ".join(map(str, choice["notes"]))
        done = CarriedOut(proposal.changes, str(choice["outcome"]), proposal.report, notes)
        return "" if done.stands else done.problem
