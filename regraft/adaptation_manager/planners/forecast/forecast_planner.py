"""The forecast's component: proposes the option that is expected to be worth most."""

from __future__ import annotations

from typing import Final

from regraft import Parameter, RefusalCode, RequestRefused, service
from regraft.adaptation_manager.planners.choices.context import numbers_of
from regraft.adaptation_manager.planners.choices.estimates import ClassEstimates
from regraft.adaptation_manager.planners.choices.fitting import check_dimensions
from regraft.adaptation_manager.planners.choices.in_architecture import changes_for
from regraft.adaptation_manager.planners.choices.inputs import Asked, inputs_schema, read_inputs
from regraft.adaptation_manager.planners.choices.objective import Evaluation
from regraft.adaptation_manager.planners.choices.settings import Setting
from regraft.adaptation_manager.planners.choices.solvers.protocol import CannotSolve
from regraft.adaptation_manager.planners.choices.space import options_of
from regraft.adaptation_manager.planners.decisions.deciding import DecidingPlanner, check_fits
from regraft.adaptation_manager.planners.forecast.decided import STRATEGY, Decided, read_decided
from regraft.adaptation_manager.planners.forecast.forecast import Forecast, ForecastKnobs, Model, model_of, outlook
from regraft.adaptation_manager.planners.manager_client import AdaptationOrder, CarriedOut, Manager, Turns
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding.records import record_shape
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.planning import (
    PlannerDescription,
    PlannerQuery,
    Proposal,
    ProposalRequest,
    StrategyDescription,
)
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.description import Resources

MAX_OPTIONS: Final = 1000
MAX_TOLD: Final = 10
"""Options whose expected utility an explanation names."""


class ForecastPlanner(DecidingPlanner):
    """Chooses the option with the highest expected utility, by the estimates of the components' classes.

    It learns nothing and needs no trials: an option's qualities are the classes' own estimates under its parameters, in
    the request's context.
    """

    resources = Resources(cpu=0.02, memory=60.0)
    cannot_express = "measured qualities, settle and range, since it learns nothing"
    handler_timeout = 2.0  # a class is loaded when it is first asked for

    answer_within = Parameter(
        5.0, "time that the adaptation manager may take to show the architecture", minimum=0.1, maximum=60.0, unit="s"
    )
    adapt_within = Parameter(30.0, "time that an adaptation may take", minimum=0.1, maximum=600.0, unit="s")

    def on_activate(self) -> None:
        """Begin with nothing under way."""
        self._manager = Manager(self.kit)
        self._turns = Turns()
        self.begin_deciding()

    @service("planners/{name}/describe")
    def describe(self, query: PlannerQuery) -> PlannerDescription:
        """Return what can be asked for."""
        text = (type(self).__doc__ or "").split("\n\n")[0]
        knobs = record_shape(ForecastKnobs).json_schema()
        strategy = StrategyDescription(STRATEGY, "Takes what is expected to be worth most.", knobs)
        inputs = self.schema_with_decisions(inputs_schema((STRATEGY,)))
        return PlannerDescription(self.kit.name, self.kit.name, text, inputs, (strategy,))

    @service("planners/{name}/propose")
    async def propose(self, request: ProposalRequest) -> Proposal:
        """Choose an option, and have it applied if that is wanted."""
        return await self.decide(request)

    async def decide(self, request: ProposalRequest) -> Proposal:
        """Answer a request; raises RequestRefused."""
        if not request.task:
            why = "is empty: name the task for which is chosen"
            raise RequestRefused(why, RefusalCode.MALFORMED, field="task")
        try:
            decided = read_decided(request.inputs, self.decision_named)
            asked, model = (None, None) if decided else _read(request.inputs)
        except BadMessage as error:
            raise RequestRefused.malformed(error.inside("inputs")) from None
        await self._turns.take(request.task)
        try:
            if decided:
                return await self._take(request, decided)
            assert asked is not None
            assert model is not None
            return await self._propose(request, asked, model)
        finally:
            self._turns.give(request.task)

    async def _propose(self, request: ProposalRequest, asked: Asked, model: Model) -> Proposal:
        architecture = await self._manager.architecture(self.answer_within)
        try:
            check_dimensions(asked.slots, architecture)
            options = options_of(asked.slots, asked.constraints, MAX_OPTIONS)
        except BadMessage as error:
            raise RequestRefused.malformed(error.inside("inputs")) from None
        context = numbers_of(request.context)
        evaluation = Evaluation(asked.slots, model.objective, context, ClassEstimates(architecture))
        outlooks = [outlook(evaluation, option) for option in options]
        chosen = _best(asked, model, outlooks, architecture)
        choice = _shown(asked, chosen, outlooks)
        if chosen is None:
            return Proposal(request.task, (), {**choice, "outcome": "unchanged"})
        return await self._carry_out(request, chosen.option.settings, choice, architecture)

    async def _take(self, request: ProposalRequest, decided: Decided) -> Proposal:
        """Take a decision."""
        architecture = await self._manager.architecture(self.answer_within)
        try:
            check_fits(decided.decision, architecture)
            situation, estimates = self.situation(decided.decision, request), self.estimates(architecture)
            option, choice = await self.kit.compute(decided.choose, architecture, situation, estimates)
        except (BadMessage, CannotSolve) as error:
            problem = error if isinstance(error, BadMessage) else BadMessage(str(error), ("knobs", "solver"))
            raise RequestRefused.malformed(problem.inside("inputs")) from None
        if option is None:
            return Proposal(request.task, (), {**choice, "outcome": "unchanged"})
        request = self.in_context(request, decided.decision, situation)
        return await self._carry_out(request, option.settings, choice, architecture)

    async def _carry_out(
        self,
        request: ProposalRequest,
        settings: tuple[Setting, ...],
        choice: dict[str, PlainValue],
        architecture: Architecture,
    ) -> Proposal:
        if not request.apply:
            changes = changes_for(settings, architecture)
            return Proposal(request.task, changes, {**choice, "outcome": "dry"})
        done: CarriedOut = await self._manager.carry_out(
            lambda seen: changes_for(settings, seen),
            architecture,
            AdaptationOrder.of(self.kit.name, request, str(choice["why"])),
            self.adapt_within,
        )
        notes = [*choice["notes"], *([done.error] if done.error else [])]
        return Proposal(
            request.task, done.changes, {**choice, "outcome": done.outcome, "notes": notes}, "", done.report
        )


def _read(plain: dict[str, PlainValue]) -> tuple[Asked, Model]:
    asked = read_inputs(plain)
    if asked.strategy != STRATEGY:
        raise BadMessage(f"there is no strategy {asked.strategy!r}; there is: {STRATEGY}", ("strategy",))
    try:
        return asked, model_of(asked.knobs)
    except BadMessage as error:
        raise error.inside("knobs") from None


def _best(asked: Asked, model: Model, outlooks: list[Forecast], architecture: Architecture) -> Forecast | None:
    """Return the best of the known: the present one, unless another is better by the margin."""
    known = [each for each in outlooks if each.utility is not None]
    if not known:
        return None
    best = max(known, key=_utility)
    stands = next((e for e in known if not changes_for(e.option.settings, architecture)), None)
    return stands if stands is not None and _utility(best) <= _utility(stands) + model.margin else best


def _utility(each: Forecast) -> float:
    assert each.utility is not None
    return each.utility


def _shown(asked: Asked, chosen: Forecast | None, outlooks: list[Forecast]) -> dict[str, PlainValue]:
    """Return a choice in plain data, for people and trees."""
    names = [slot.name for slot in asked.slots]
    told: dict[str, PlainValue] = {"strategy": STRATEGY, "options": len(outlooks), "notes": []}
    if chosen is None:
        return told | {
            "option": None,
            "why": f"nothing can be expected: {outlooks[0].why if outlooks else 'no option'}",
        }
    expected = ", ".join(
        f"{'/'.join(str(value) for value in each.option.values)}: {each.utility:.4g}"
        for each in outlooks[:MAX_TOLD]
        if each.utility is not None
    )
    return told | {
        "option": dict(zip(names, chosen.option.values, strict=True)),
        "utility": chosen.utility,
        "why": f"expected {chosen.utility:.4g} ({expected})",
    }
