"""Decisions and choices as lines for people, and as plain data."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

from regraft.adaptation_manager.planners.choices.choosing import Choice
from regraft.adaptation_manager.planners.choices.slots import Slot
from regraft.adaptation_manager.planners.decisions.model import ContextEntry, Decision
from regraft.adaptation_manager.planners.decisions.question import Question
from regraft.bus_schema.annotations import PlainValue


def decision_lines(decision: Decision) -> Iterator[str]:
    """Yield what a decision is about."""
    for slot in decision.slots:
        yield f"choice {slot.name}: {_cardinality(slot)}{', '.join(str(each.name) for each in slot.alternatives)}"
    for entry in decision.context:
        yield f"context {entry.name}: {_source(entry)}"
    for quality in decision.qualities:
        how = [f"measured {quality.measured.text}"] if quality.measured else []
        how += [f"estimated {quality.estimated.text}"] if quality.estimated else []
        yield f"quality {quality.name}: {', '.join(how)}"
    yield from (text for text, _ in decision.rules)
    yield from (each.text for each in decision.requirements)
    yield from (each.text for each in decision.limits)
    for fault in decision.faults:
        yield f"fault {fault.name}: {fault.when.text}"
    yield f"utility: {decision.utility.text}"


def _cardinality(slot: Slot) -> str:
    return "" if slot.is_single else f"{slot.least} to {slot.most} of "


def _source(entry: ContextEntry) -> str:
    if entry.requirement:
        return f"whether {entry.requirement} is met"
    if entry.request:
        return f"{entry.request}, told with each request"
    if entry.component:
        return f"whether {entry.component} has failed"
    reading = entry.reading
    field = f"{entry.topic}.{reading.field}" if reading else entry.topic
    return f"{reading.reduce.value} of {field}" if reading and reading.reduce else field


def choice_lines(decision: Decision, question: Question, choice: Choice) -> Iterator[str]:
    """Yield what was chosen, and why."""
    told = choice.explanation
    if choice.option is None:
        yield f"chosen: nothing, because {told.nothing}"
    else:
        names = [slot.name for slot in decision.slots]
        yield f"chosen: {shown(names, choice.option.values)}, utility {_number(choice.utility)}"
        yield from (f"  {_change(change)}" for change in choice.changes)
        if not choice.changes:
            yield "  it stands already"
        for runner_up in told.runners_up:
            yield f"next: {shown(names, runner_up.values)}, utility {runner_up.utility:.4g}"
    for fault in question.faults:
        yield f"fault: {fault}"
    for excluded in told.excluded:
        yield f"excluded: {excluded.slot} {excluded.alternative}, because of {excluded.why}"
    for prediction in told.predicted:
        now, then = _number(prediction.before), _number(prediction.after)
        if question.standing.values:
            now, then = f"{now} ({prediction.before_from})", f"{then} ({prediction.after_from})"
        yield f"predicted {prediction.name}: {now} now, {then} then"
    for name, sources in question.standing.sources.items():
        where = ", ".join(f"{each} {_number(m.value)} at {m.stamp:g} s" for each, m in sources.items())
        yield f"measured {name}: {where}"
    for note in dict.fromkeys((*question.notes, *told.unknown)):
        yield f"note: {note}"
    proof = "proven" if told.proven else f"not proven, up to {told.gap:.4g} better is possible"
    yield f"{told.solver}: {told.combinations} combinations, {told.steps} steps, {told.seconds * 1e3:.1f} ms, {proof}"


def shown(names: list[str], values: tuple[PlainValue, ...]) -> str:
    """Return what is chosen for each slot as text."""
    return ", ".join(f"{name} {value}" for name, value in zip(names, values, strict=True))


def _change(change: Any) -> str:
    fields = ", ".join(f"{name} {value}" for name, value in asdict(change).items() if value)
    return f"{change.change}: {fields}"


def _number(value: float | None) -> str:
    return "unknown" if value is None else f"{value:.4g}"


def choice_plain(decision: Decision, question: Question, choice: Choice) -> dict[str, Any]:
    """Return a choice as plain data, without the time that it took: it is equal for equal situations."""
    told = choice.explanation
    names = [slot.name for slot in decision.slots]
    return {
        "option": dict(zip(names, choice.option.values, strict=True)) if choice.option else None,
        "utility": choice.utility,
        "standing": told.standing,
        "combinations": told.combinations,
        "faults": list(question.faults),
        "excluded": [asdict(each) for each in told.excluded],
        "runners_up": [
            {"option": dict(zip(names, each.values, strict=True)), "utility": each.utility} for each in told.runners_up
        ],
        "measured": question.standing.plain(),
        "predicted": {
            each.name: {
                "before": each.before,
                "after": each.after,
                "before_from": each.before_from,
                "after_from": each.after_from,
            }
            for each in told.predicted
        },
        "solver": told.solver,
        "steps": told.steps,
        "proven": told.proven,
        "gap": told.gap if told.gap != float("inf") else None,
        "notes": [*dict.fromkeys((*question.notes, *told.unknown))],
    }
