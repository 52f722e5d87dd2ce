"""The bandits' component: proposes what a strategy chooses, and learns from what it is told of the effect."""

from __future__ import annotations

from typing import Final

from regraft import Component, Parameter, RefusalCode, RequestRefused, service
from regraft.adaptation_manager.planners.bandits.credit import Credit, read_credit
from regraft.adaptation_manager.planners.bandits.memory import Chosen, TaskMemory
from regraft.adaptation_manager.planners.bandits.strategy_registry import Strategies
from regraft.adaptation_manager.planners.bandits.tickets import Told
from regraft.adaptation_manager.planners.choices.context import numbers_of
from regraft.adaptation_manager.planners.choices.fitting import check_dimensions
from regraft.adaptation_manager.planners.choices.in_architecture import changes_for
from regraft.adaptation_manager.planners.choices.inputs import Asked, inputs_schema, read_inputs
from regraft.adaptation_manager.planners.choices.slots import Option
from regraft.adaptation_manager.planners.choices.space import options_of
from regraft.adaptation_manager.planners.manager_client import AdaptationOrder, Manager, Turns
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.planning import PlannerDescription, PlannerQuery, Proposal, ProposalRequest
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.description import Resources

MAX_TASKS: Final = 256
"""Tasks that are remembered; beyond it, the one that asked least recently is forgotten, with an event."""
SPACES_KEPT: Final = 16


class BanditPlanner(Component):
    """Chooses among options by a bandit strategy that learns, for each task, what they are worth."""

    resources = Resources(cpu=0.01, memory=35.0)
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

    def on_activate(self) -> None:
        """Begin with nothing under way."""
        self._manager = Manager(self.kit)
        self._turns = Turns()
        self._spaces: dict[str, tuple[Option, ...] | BadMessage] = {}

    # --- services ---

    @service("planners/{name}/describe")
    def describe(self, query: PlannerQuery) -> PlannerDescription:
        """Say what can be asked for: the strategies with their knobs, the form of the inputs."""
        text = (type(self).__doc__ or "").split("\n\n")[0]
        strategies = self._strategies.describe()
        return PlannerDescription(
            self.kit.name, self.kit.name, text, inputs_schema(self._strategies.names()), strategies
        )

    @service("planners/{name}/propose")
    async def propose(self, request: ProposalRequest) -> Proposal:
        """Take the credit that is given, choose an option, and have it applied if that is wanted."""
        if not request.task:
            why = "is empty: name the task for which is learned"
            raise RequestRefused(why, RefusalCode.MALFORMED, field="task")
        try:
            asked, credit = self._read(request)
        except BadMessage as error:
            raise RequestRefused.malformed(error) from None
        options = await self._options(asked)
        await self._turns.take(request.task)
        try:
            return await self._propose(request, asked, credit, options)
        finally:
            self._turns.give(request.task)

    def _read(self, request: ProposalRequest) -> tuple[Asked, Credit | None]:
        try:
            asked = read_inputs(request.inputs)
            self._strategies.knobs(asked.strategy, asked.knobs)
            return asked, None if asked.credit is None else read_credit(asked.credit)
        except BadMessage as error:
            raise error.inside("inputs") from None

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
        self, request: ProposalRequest, asked: Asked, credit: Credit | None, options: tuple[Option, ...]
    ) -> Proposal:
        architecture = await self._manager.architecture(self.answer_within)
        context = numbers_of(request.context)
        memory = self._memory(request.task)
        knobs = self._strategies.knobs(asked.strategy, asked.knobs)
        try:
            check_dimensions(asked.slots, architecture)
            memory.check(asked.strategy, knobs, options, context)
            told = memory.credit(credit, architecture) if credit else None
            seed = f"{self.kit.seed}/{self.seed}"
            chosen = memory.choose(asked.strategy, knobs, asked.slots, options, context, seed)
        except BadMessage as error:
            raise RequestRefused.malformed(error.inside("inputs")) from None
        if not request.apply:
            changes = changes_for(chosen.option.settings, architecture)
            return Proposal(request.task, changes, _shown(chosen, "dry", told))
        return await self._carry_out(request, asked, chosen, told, architecture)

    async def _carry_out(
        self, request: ProposalRequest, asked: Asked, chosen: Chosen, told: Told | None, seen: Architecture
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
        choice = _shown(chosen, done.outcome, told)
        if done.disturbed:
            memory.disturbed(began)
        ticket = ""
        if done.stands:
            now = self.kit.now()
            ticket, since = memory.stood(chosen, now, asked.settle, changed=bool(done.changes))
            choice |= {"applied": now, "measure_from": since}
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
            self.kit.event("planner.forgot", f"task {oldest!r} was forgotten: there are more than {MAX_TASKS}")
        return memory

    def snapshot(self) -> PlainValue:
        """Return what was learned, and the tickets that are out."""
        return {task: memory.state() for task, memory in self._memories.items()}

    def restore(self, state: PlainValue) -> None:
        """Continue with what was learned."""
        for task, kept in state.items():
            self._memories[task] = TaskMemory(task, self._strategies)
            self._memories[task].restore(kept)


def _shown(chosen: Chosen, outcome: str, told: Told | None) -> dict[str, PlainValue]:
    """Return what people and trees are told of a choice."""
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
    if told:
        shown["credit"] = told.shown()
    return shown
