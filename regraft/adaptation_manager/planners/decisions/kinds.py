"""The kinds of the names of a decision, and the expressions that do not fit them."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping

from regraft.adaptation_manager.planners.choices.objective import TOTAL
from regraft.adaptation_manager.planners.choices.slots import Slot
from regraft.adaptation_manager.planners.decisions.model import (
    NO_COMPONENTS,
    ContextEntry,
    Decision,
    expressions_of,
)
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding.reading_checks import ValueKind, reading_kind
from regraft.bus_schema.model.expression_kinds import kind_of, kind_problems
from regraft.bus_schema.model.expressions import Expression
from regraft.bus_schema.suggestions import instead_of
from regraft.stack.yaml.problems import Report

OF_CONDITIONS = ("require", "when")
"""The last parts of fields whose expressions are true or false, next to bounds."""
ANY_KIND = ("objective.weights.", "objective.assume.")
"""The begins of fields whose expressions may be of any kind."""


def check_kinds(
    decision: Decision,
    report: Report,
    read: Mapping[str, ValueKind | None] | None = None,
    texts: Mapping[str, Collection[str]] | None = None,
) -> None:
    """Note expressions of the wrong kind, and texts with which nothing can be equal.

    ``read`` has the kinds of entries of topics, None for any. ``texts`` has all texts that an entry may be.
    """
    kinds = _kinds(decision, read or {})
    known = _texts(decision) | dict(texts or {})
    for path, expression in expressions_of(decision):
        wanted = _wanted(path)
        problems = kind_problems(expression, kinds, wanted) or list(_never_equal(expression, known))
        if not problems and wanted is ValueKind.TRUTH and not expression.names:
            problems = [
                f"{expression.text!r} speaks of nothing that changes: must be a condition, such as: charge > 0.5"
            ]
        for problem in problems:
            report.add(path, problem)


def _wanted(path: str) -> ValueKind | None:
    if path.startswith(ANY_KIND):
        return None
    is_condition = path.rpartition(".")[2] in OF_CONDITIONS or path.startswith("objective.bounds.")
    return ValueKind.TRUTH if is_condition else ValueKind.NUMBER


def _kinds(decision: Decision, read: Mapping[str, ValueKind | None]) -> dict[str, ValueKind]:
    """Return the kinds of all names that expressions speak of, without those of any kind."""
    found: dict[str, ValueKind | None] = dict.fromkeys(_numbers(decision), ValueKind.NUMBER)
    found |= {slot.name: _kind_of_slot(slot) for slot in decision.slots}
    found |= {entry.name: _kind_of_entry(entry) for entry in decision.context} | dict(read)
    for name, expression in decision.weights.items():
        found[name] = kind_of(expression, _known(found))
    for name, expression in decision.assume:
        kind = kind_of(expression, _known(found))
        # Estimates have the assumption, all else has the entry of the context of that name.
        found[name] = kind if found.get(name, kind) is kind else None
    known = _known(found)
    for quality in decision.qualities:
        both = {kind_of(each, known) for each in (quality.measured, quality.estimated) if each is not None}
        kind = both.pop() if len(both) == 1 else None
        # One that is a text is noted itself: what speaks of it is right.
        found[quality.name] = None if kind is ValueKind.TEXT else kind
    return _known(found)


def _known(kinds: Mapping[str, ValueKind | None]) -> dict[str, ValueKind]:
    return {name: kind for name, kind in kinds.items() if kind is not None}


def _numbers(decision: Decision) -> Iterator[str]:
    """Yield the names with dots that are numbers: figures, their sums, and estimates of components."""
    for _, expression in expressions_of(decision):
        for name in expression.names:
            if "." in name and (name.split(".")[0] not in NO_COMPONENTS or name.startswith(f"{TOTAL}.")):
                yield name


def _kind_of_entry(entry: ContextEntry) -> ValueKind | None:
    if entry.reading is not None:
        return reading_kind(None, entry.reading)
    return ValueKind.TRUTH if entry.component or entry.requirement else None


def _kind_of_slot(slot: Slot) -> ValueKind | None:
    """Return the kind of a slot's value: the name of what is chosen, or a list where several may be."""
    if not slot.is_single:
        return ValueKind.LIST
    kinds = {_kind_of_name(alternative.name) for alternative in slot.alternatives}
    return kinds.pop() if len(kinds) == 1 else None


def _kind_of_name(name: PlainValue) -> ValueKind | None:
    if isinstance(name, bool):
        return ValueKind.TRUTH
    if isinstance(name, str):
        return ValueKind.TEXT
    return ValueKind.NUMBER if isinstance(name, int | float) else ValueKind.LIST if name is not None else None


def _texts(decision: Decision) -> dict[str, Collection[str]]:
    """Return the names of alternatives by those of choices."""
    return {slot.name: [str(alternative.name) for alternative in slot.alternatives] for slot in decision.slots}


def _never_equal(expression: Expression, texts: Mapping[str, Collection[str]]) -> Iterator[str]:
    """Yield why names are compared with texts that they never are."""
    for name, value in expression.compared():
        if name in texts and isinstance(value, str) and value not in texts[name]:
            yield f"{name} is compared with {value!r}, which it never is; {instead_of(value, texts[name])}"
