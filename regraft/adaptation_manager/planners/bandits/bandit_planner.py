"""The bandits' component: proposes what a strategy chooses, and learns from the measured effect."""

from __future__ import annotations

from typing import Final

from regraft import Parameter, RefusalCode, RequestRefused, service
from regraft.adaptation_manager.planners.bandits.credit import Credit, read_credit
from regraft.adaptation_manager.planners.bandits.decided import Meters, asked_for, options_in
from regraft.adaptation_manager.planners.bandits.strategy_registry import Strategies
from regraft.adaptation_manager.planners.bandits.task_memory import Chosen, TaskMemory
from regraft.adaptation_manager.planners.bandits.tickets import Told
from regraft.adaptation_manager.planners.choices.context import numbers_of
from regraft.adaptation_manager.planners.choices.fitting import check_dimensions
from regraft.adaptation_manager.planners.choices.in_architecture import changes_for
from regraft.adaptation_manager.planners.choices.inputs import Asked, inputs_schema, read_inputs
from regraft.adaptation_manager.planners.choices.slots import Option
from regraft.adaptation_manager.planners.choices.space import options_of
from regraft.adaptation_manager.planners.decisions.deciding import DecidingPlanner, check_fits, read_decision_inputs
from regraft.adaptation_manager.planners.decisions.measuring import SAMPLE_EVERY
from regraft.adaptation_manager.planners.decisions.model import Decision
from regraft.adaptation_manager.planners.decisions.question import Question, question_of
from regraft.adaptation_manager.planners.manager_client import AdaptationOrder, Manager, Turns
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.planning import PlannerDescription, PlannerQuery, Proposal, ProposalRequest
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.description import Resources

MAX_TASKS: Final = 256
"""Tasks that are remembered; beyond it, the one that asked least recently is forgotten, with an event."""
SPACES_KEPT: Final = 16


class BanditPlanner(DecidingPlanner):
    """Chooses among options by a bandit strategy that learns, for each task, what they are worth."""

    resources = Resources(cpu=0.01, memory=35.0)
    cannot_express = "what is expected of an option, except within constraints and bounds; and a margin"
    state_version = 1
    checkpoint_every = 1.0

    seed = Parameter(0, "tells apart what is drawn at random, beside the seed of the run")
    strategies = Parameter(
        "", "further strategies, as module:Class, separated by blanks; installed ones are known", read_only=True
    )
    most_options = Parameter(10_000, "options that a space may have", minimum=1, maximum=100_000)
    rest = Parameter(
        3, "proposals for which an option rests that could not be applied, doubled each time", minimum=0, maximum=1000
    )
    answer_within = Parameter(
        5.0, "time that the adaptation manager may take to show the architecture", minimum=0.1, maximum=60.0, unit="s"
    )
    adapt_within = Parameter(30.0, "time that an adaptation may take", minimum=0.1, maximum=600.0, unit="s")

    def on_configure(self) -> None:
        """Find the strategies; raises BadStrategy."""
        self._strategies = Strategies(self.strategies.split())
        self._memories: dict[str, TaskMemory] = {}
        self._meters = Meters()

    def on_activate(self) -> None:
        """Begin with nothing under way."""
        self._manager = Manager(self.kit)
        self._turns = Turns()
        self._spaces: dict[str, tuple[Option, ...] | BadMessage] = {}
        self.begin_deciding()
        self._meters.keep_fitting(self.known_decisions)
        if self.known_decisions:
            self.kit.spawn(self._measure(), "measuring what choices are worth")

    # --- services ---

    @service("planners/{name}/describe")
    def describe(self, query: PlannerQuery) -> PlannerDescription:
        """Return what can be asked for: the strategies with their knobs, the form of the inputs."""
        text = (type(self).__doc__ or "").split("\n\n")[0]
        strategies = self._strategies.describe()
        inputs = self.schema_with_decisions(inputs_schema(self._strategies.names()))
        return PlannerDescription(self.kit.name, self.kit.name, text, inputs, strategies)

    @service("planners/{name}/propose")
    async def propose(self, request: ProposalRequest) -> Proposal:
        """Take the credit that is given, choose an option, and have it applied if that is wanted."""
        return await self.decide(request)

    async def decide(self, request: ProposalRequest) -> Proposal:
        """Answer a request; raises RequestRefused."""
        if not request.task:
            why = "is empty: name the task for which is learned"
            raise RequestRefused(why, RefusalCode.MALFORMED, field="task")
        try:
            asked, credit, decision = self._read(request)
        except BadMessage as error:
            raise RequestRefused.malformed(error.inside("inputs")) from None
        options = await self._options(asked) if decision is None else ()
        await self._turns.take(request.task)
        try:
            return await self._propose(request, asked, credit, options, decision)
        finally:
            self._turns.give(request.task)

    def _read(self, request: ProposalRequest) -> tuple[Asked, Credit | None, Decision | None]:
        decision = None
        if "decision" in request.inputs:
            inputs = read_decision_inputs(request.inputs)
            decision = self.decision_named(inputs.decision)
            asked = asked_for(decision, inputs)
        else:
            asked = read_inputs(request.inputs)
        self._strategies.knobs(asked.strategy, asked.knobs)
        return asked, None if asked.credit is None else read_credit(asked.credit), decision

    async def _options(self, asked: Asked) -> tuple[Option, ...]:
        """Return the options; these, or why there are none, are found once for equal slots and constraints."""
        known = repr((asked.slots, asked.constraints, self.most_options))
        found = self._spaces.pop(known, None)
        if found is None:
            try:
                found = await self.kit.compute(options_of, asked.slots, asked.constraints, self.most_options)
            except BadMessage as error:
                found = error.inside("inputs")
        self._spaces[known] = found
        if len(self._spaces) > SPACES_KEPT:
            del self._spaces[next(iter(self._spaces))]
        if isinstance(found, BadMessage):
            raise RequestRefused.malformed(found)
        return found

    # --- one proposal ---

    async def _propose(
        self,
        request: ProposalRequest,
        asked: Asked,
        credit: Credit | None,
        options: tuple[Option, ...],
        decision: Decision | None,
    ) -> Proposal:
        architecture = await self._manager.architecture(self.answer_within)
        context, question = numbers_of(request.context), None
        memory = self._memory(request.task)
        knobs = self._strategies.knobs(asked.strategy, asked.knobs)
        try:
            if decision is None:
                check_dimensions(asked.slots, architecture)
            else:
                situation = self.situation(decision, request)
                check_fits(decision, architecture)
                standing = self.standing(decision, situation, architecture)
                question = question_of(decision, situation, self.estimates(architecture), standing)
                request = self.in_context(request, decision, situation, standing)
                context = numbers_of(situation)
                options = await self.kit.compute(options_in, question, self.most_options)
                if request.apply:
                    measured, unknown = self._meters.credit(request.task)
                    credit = credit or measured
                    if credit is None and unknown:
                        question.notes.append(f"the choice before has no credit: {unknown}")
            memory.check(asked.strategy, knobs, options, context)
            if decision is not None and request.apply and credit is not None:
                self._meters.end(request.task)
            told = memory.credit(credit, architecture) if credit else None
            seed = f"{self.kit.seed}/{self.seed}"
            chosen = memory.choose(asked.strategy, knobs, asked.slots, options, context, seed)
        except BadMessage as error:
            raise RequestRefused.malformed(error.inside("inputs")) from None
        if not request.apply:
            changes = changes_for(chosen.option.settings, architecture)
            return Proposal(request.task, changes, _shown(chosen, "dry", told, question))
        return await self._carry_out(request, asked, chosen, told, architecture, question)

    async def _measure(self) -> None:
        while True:
            await self.kit.sleep(SAMPLE_EVERY)
            self._meters.sample(self.kit.now(), self.known_decisions, self.measured_situation)

    async def _carry_out(
        self,
        request: ProposalRequest,
        asked: Asked,
        chosen: Chosen,
        told: Told | None,
        seen: Architecture,
        question: Question | None,
    ) -> Proposal:
        memory = self._memory(request.task)
        memory.keep(chosen)
        began = self.kit.now()
        done = await self._manager.carry_out(
            lambda architecture: changes_for(chosen.option.settings, architecture),
            seen,
            AdaptationOrder.of(self.kit.name, request, f"{chosen.strategy} for {request.task}: {chosen.why}"),
            self.adapt_within,
        )
        choice = _shown(chosen, done.outcome, told, question)
        if done.disturbed:
            memory.disturbed(began)
            self._meters.end(request.task)
        ticket = ""
        if done.stands:
            now = self.kit.now()
            ticket, since = memory.stood(chosen, now, asked.settle, changed=bool(done.changes))
            choice |= {"applied": now, "measure_from": since}
            if question is not None:
                if done.changes:
                    self.note_change(question.decision, since)
                self._meters.begin(request.task, question.decision, chosen.option, ticket, since)
        elif done.outcome != "refused":
            choice["rests"] = memory.failed(chosen, self.rest)
        if done.error:
            choice["notes"] = [*choice["notes"], done.error]
        self.kit.set_status_text(f"{request.task}: {chosen.strategy} chose {choice['option']}: {done.outcome}")
        return Proposal(request.task, done.changes, choice, ticket, done.report)

    # --- what is kept ---

    def _memory(self, task: str) -> TaskMemory:
        """Return what is known for a task, as the one that asked last."""
        memory = self._memories.pop(task, None) or TaskMemory(task, self._strategies)
        self._memories[task] = memory
        if len(self._memories) > MAX_TASKS:
            oldest = next(iter(self._memories))
            del self._memories[oldest]
            self._meters.end(oldest)
            self.kit.event("planner.forgot", f"task {oldest!r} was forgotten: there are more than {MAX_TASKS}")
        return memory

    def snapshot(self) -> PlainValue:
        """Return what was learned, the tickets that are out, and what was measured of what is in force."""
        return {task: {**memory.state(), "meter": self._meters.state(task)} for task, memory in self._memories.items()}

    def restore(self, state: PlainValue) -> None:
        """Continue with what was learned."""
        for task, kept in state.items():
            self._memories[task] = TaskMemory(task, self._strategies)
            self._memories[task].restore(kept)
            self._meters.restore(task, kept.get("meter"))  # an earlier version has none


def _shown(chosen: Chosen, outcome: str, told: Told | None, question: Question | None) -> dict[str, PlainValue]:
    """Return a choice in plain data, for people and trees."""
    names = [slot.name for slot in chosen.slots]
    shown: dict[str, PlainValue] = {
        "strategy": chosen.strategy,
        "option": dict(zip(names, chosen.option.values, strict=True)),
        "options": chosen.options,
        "resting": chosen.resting,
        "why": chosen.why,
        "outcome": outcome,
        "notes": [*chosen.notes, *(told.notes if told else ())],
    }
    if question is not None:
        shown["decision"] = question.decision.name
        shown["faults"] = list(question.faults)
        shown["excluded"] = question.excluded()
        shown["measured"] = question.standing.plain()
        shown["notes"] += question.notes
    if told:
        shown["credit"] = told.shown()
    return shown
