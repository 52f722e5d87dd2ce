"""An adaptation's estimate: durations from the past, qualities from classes before and after."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from regraft import Future
from regraft.adaptation_manager.planning.durations import Durations
from regraft.adaptation_manager.planning.plan import Plan
from regraft.adaptation_manager.targets.component_client import ControlFailed
from regraft.adaptation_manager.targets.context import ExecutionContext
from regraft.adaptation_manager.targets.host_client import FIRST
from regraft.bus.interface import Answer, BusError
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.management.qualities import MeasuredQualities
from regraft.bus_schema.messages.protocol.host import EstimatedQualities, EstimateQualities
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.qualities.estimates import Estimate, Figure, QualityEstimate, Source
from regraft.bus_schema.model.qualities.qualities import NOT_GIVEN, ONLY_MEASURED, measured
from regraft.patience import stretched

UNSAID = (NOT_GIVEN, ONLY_MEASURED)
"""Reasons for unknown figures that are no news."""


async def estimated(
    plan: Plan, context: ExecutionContext, durations: Durations, request_context: dict[str, PlainValue]
) -> Estimate:
    """Return what the plan would take, and the qualities that it would change, in ``request_context``."""
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
    await context.refresh()
    before, after = plan.before.components, plan.after.components
    wanted = EstimateQualities(
        tuple(before.values()), tuple(after.values()), request_context, await _measured(before, context)
    )
    changed = sorted(name for name in before.keys() | after.keys() if before.get(name) != after.get(name))
    homes = {name: (after.get(name) or before[name]).host for name in changed}
    answers = {host: await _answer(host, wanted, context) for host in sorted({FIRST, *homes.values()})}
    names = sorted({*changed, *answers[FIRST].before, *answers[FIRST].after})
    active = {name for name, spec in after.items() if spec.state is State.ACTIVE}
    return tuple(
        line for name in names for line in _lines(name, answers[homes.get(name, FIRST)], name in homes, name in active)
    )


async def _answer(host: str, wanted: EstimateQualities, context: ExecutionContext) -> EstimatedQualities:
    """Ask a host, which may be the only one that can import the classes of its components."""
    try:
        return await context.hosts.estimate(host, wanted)
    except ControlFailed as error:
        return EstimatedQualities(*(_unknown(specs, str(error)) for specs in (wanted.before, wanted.after)))


def _unknown(specs: Sequence[ComponentSpec], why: str) -> dict[str, dict[str, Figure]]:
    return {
        spec.name: {quality.name: Figure(None, Source.UNKNOWN, why) for quality in spec.description.qualities}
        for spec in specs
        if spec.description is not None
    }


def _lines(component: str, found: EstimatedQualities, changed: bool, active: bool) -> Iterator[QualityEstimate]:
    """Yield the figures of a component that is changed, and of another one those that differ afterwards."""
    before, after = found.before.get(component, {}), found.after.get(component, {})
    for quality in sorted({*before, *after}):
        was, will = before.get(quality, Figure()), after.get(quality, Figure())
        known = was.value is not None or will.value is not None
        failed = active and will.value is None and will.why not in UNSAID
        if was != will if not changed else known or failed:
            yield QualityEstimate(component, quality, was.value, will.value, was.source, will.source, was.why, will.why)


async def _measured(specs: Mapping[str, ComponentSpec], context: ExecutionContext) -> dict[str, dict[str, float]]:
    """Return what the active components have measured last; one that does not answer has measured nothing."""
    asked = {name: _ask(context, spec) for name, spec in specs.items() if _measures(spec)}
    return {name: values for name, waiting in asked.items() if (values := await _told(waiting))}


def _measures(spec: ComponentSpec) -> bool:
    described = spec.description
    return spec.state is State.ACTIVE and described is not None and bool(measured(described.qualities))


def _ask(context: ExecutionContext, spec: ComponentSpec) -> Future[list[Answer]] | None:
    process = context.controls.living(spec.name) if spec.managed else None
    if process is None:
        return None
    key = Keys(context.kit.system).control(spec.name, process.incarnation, "qualities")
    try:
        return context.kit.ask(key, b"", stretched(context.bounds.answer))
    except BusError:
        return None


async def _told(waiting: Future[list[Answer]] | None) -> dict[str, float]:
    answers = await waiting if waiting is not None else []
    good = next((answer for answer in answers if not answer.error), None)
    try:
        return codec.decode(good.payload, MeasuredQualities).values if good is not None else {}
    except BadMessage:
        return {}
