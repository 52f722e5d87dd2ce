"""An adaptation's estimate: durations from the past, qualities from the components themselves."""

from __future__ import annotations

from regraft import Future
from regraft.adaptation_manager.planning.durations import Durations
from regraft.adaptation_manager.planning.plan import Plan
from regraft.adaptation_manager.targets.context import ExecutionContext
from regraft.bus.interface import Answer, BusError
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.protocol.control import AskQualities, Qualities
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.estimates import Estimate, QualityEstimate
from regraft.bus_schema.model.lifecycle import State
from regraft.patience import stretched


async def estimated(
    plan: Plan, context: ExecutionContext, durations: Durations, request_context: dict[str, PlainValue]
) -> Estimate:
    """Return what the plan would take, and the qualities of all that it changes, in ``request_context``."""
    steps = durations.of(plan)
    return Estimate(
        sum(step.median for step in steps) + durations.around(0.5),
        sum(step.p95 for step in steps) + durations.around(0.95),
        steps,
        await _qualities(plan, context, request_context),
    )


async def _qualities(
    plan: Plan, context: ExecutionContext, request_context: dict[str, PlainValue]
) -> tuple[QualityEstimate, ...]:
    before, after = plan.before.components, plan.after.components
    changed = sorted(name for name in before.keys() | after.keys() if before.get(name) != after.get(name))
    await context.refresh()
    asked = {
        name: (_ask(context, before.get(name), {}, request_context), _ask_after(plan, context, name, request_context))
        for name in changed
    }
    found = []
    for name, (now, then) in asked.items():
        told, expected = await _told(now), plan.estimated.get(name) or await _told(then)
        told = told if _is_active(before.get(name)) else {}
        expected = expected if _is_active(after.get(name)) else {}
        found += [
            QualityEstimate(name, quality, told.get(quality), expected.get(quality))
            for quality in sorted({*told, *expected})
        ]
    return tuple(found)


def _is_active(spec: ComponentSpec | None) -> bool:
    return spec is not None and spec.state is State.ACTIVE


def _ask_after(
    plan: Plan, context: ExecutionContext, name: str, request_context: dict[str, PlainValue]
) -> Future[list[Answer]] | None:
    """Ask a component that runs what it would give with the parameters that it is to have."""
    spec, former = plan.after.components.get(name), plan.before.components.get(name)
    if spec is None or former is None or former.cls != spec.cls:
        return None
    return _ask(context, spec, spec.parameters, request_context)


def _ask(
    context: ExecutionContext,
    spec: ComponentSpec | None,
    parameters: dict[str, PlainValue],
    request_context: dict[str, PlainValue],
) -> Future[list[Answer]] | None:
    process = context.controls.living(spec.name) if spec is not None and spec.managed else None
    if spec is None or process is None:
        return None
    key = Keys(context.kit.system).control(spec.name, process.incarnation, "describe")
    try:
        return context.kit.ask(
            key, codec.encode(AskQualities(parameters, request_context)), stretched(context.bounds.answer)
        )
    except BusError:
        return None


async def _told(waiting: Future[list[Answer]] | None) -> dict[str, float]:
    """Return what was answered; whoever does not answer, or not well, says nothing of its qualities."""
    answers = await waiting if waiting is not None else []
    good = next((answer for answer in answers if not answer.error), None)
    try:
        return codec.decode(good.payload, Qualities).estimated if good is not None else {}
    except BadMessage:
        return {}
