"""Checks the conditions of an adaptation that is to be confirmed against the architecture that it leads to."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from regraft.bus_schema.encoding.reading_checks import ValueKind
from regraft.bus_schema.model.adaptation import Violation
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.constraints import split_parameter
from regraft.bus_schema.model.description import Description
from regraft.bus_schema.model.expression_kinds import kind_of_parameter, kind_problems
from regraft.bus_schema.model.expressions import Expression
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.qualities.qualities import QualityDescription, measured
from regraft.bus_schema.model.watched import Condition
from regraft.bus_schema.suggestions import instead_of

Components = Mapping[str, ComponentSpec]

ACTIVE = "active"
"""In expressions, behind a component's name: whether it is active."""


def watch_violations(watch: Sequence[Condition], confirm: float, after: Components) -> Iterator[Violation]:
    """Yield what is wrong with the conditions of a request that watches for ``confirm`` seconds; ``after`` is with it.

    Whether a requirement is reported is not known here.
    """
    if watch and not confirm:
        yield Violation(None, "", "watch", "is of no use without 'confirm', the seconds to watch for")
        return
    for index, condition in enumerate(watch):
        for problem in _problems(condition, confirm, after):
            yield Violation(None, "", f"watch.{index}.{condition.kind}", problem)


def _problems(condition: Condition, confirm: float, after: Components) -> Iterator[str]:
    if condition.component:
        found = _component(condition.component, after)
        if isinstance(found, str):
            yield found
    elif condition.quality:
        name, quality = split_parameter(condition.quality)
        found = _component(name, after)
        if isinstance(found, str):
            yield found
        else:
            yield from _of_quality(found, quality, condition, confirm)
    elif condition.require:
        yield from _of_expression(Expression(condition.require), confirm, after)


def _of_expression(expression: Expression, confirm: float, after: Components) -> Iterator[str]:
    wrong = set()
    for name in expression.names:
        found = _component(split_parameter(name)[0], after)
        problem = found if isinstance(found, str) else _of_name(found, split_parameter(name)[1], confirm)
        if problem:
            wrong.add(name)
            yield problem
    for name, value in expression.compared():
        component, what = split_parameter(name)
        if name in wrong or _has_parameter(after[component], what):
            continue
        if what == ACTIVE and not isinstance(value, bool):
            wrong.add(name)
            yield f"{name} is true or false, and is compared with {value!r}"
        elif what != ACTIVE and isinstance(value, str):
            wrong.add(name)
            yield f"{name} is a number, and is compared with the text {value!r}"
    if not wrong:
        yield from kind_problems(expression, _kinds(expression, after), ValueKind.TRUTH)


def _kinds(expression: Expression, after: Components) -> dict[str, ValueKind]:
    """Return the kinds of names whose components are there: of parameters, of qualities, of whether one is active."""
    found = {}
    for name in expression.names:
        component, what = split_parameter(name)
        description = after[component].description
        parameter = description.parameter(what) if description else None
        kind = kind_of_parameter(parameter) if parameter else None
        if parameter is None:
            kind = ValueKind.TRUTH if what == ACTIVE else ValueKind.NUMBER
        if kind is not None:
            found[name] = kind
    return found


def _component(name: str, after: Components) -> ComponentSpec | str:
    """Return the spec of a component that can be asked, or why there is none."""
    spec = after.get(name)
    if spec is None:
        return f"there is no component {name!r} afterwards; {instead_of(name, after)}"
    return spec if spec.managed else f"{name} is unmanaged: it reports neither states nor qualities"


def qualities_of(description: Description | None) -> dict[str, QualityDescription]:
    """Return the qualities that a component measures and publishes, by name."""
    if description is None or description.evaluate_every is None:
        return {}
    return {quality.name: quality for quality in measured(description.qualities)}


def _of_quality(spec: ComponentSpec, name: str, condition: Condition, confirm: float) -> Iterator[str]:
    known = qualities_of(spec.description)
    if name not in known:
        yield _no_quality(spec, name)
        return
    if spec.state is not State.ACTIVE:
        yield f"{spec.name} is {spec.state.value} afterwards: it measures its qualities only while active"
    least, most = condition.bounds
    for bound, outside in ((least, known[name].maximum), (most, known[name].minimum)):
        if bound is not None and outside is not None and (bound > outside if bound is least else bound < outside):
            yield f"can never be {condition.wanted}: {spec.name}.{name} has the range {_range(known[name])}"
            break
    yield from _too_short(spec, confirm)


def _too_short(spec: ComponentSpec, confirm: float) -> Iterator[str]:
    period = spec.description.evaluate_every if spec.description else None
    if period is not None and confirm < period:
        yield (
            f"{spec.name} measures its qualities every {period:g} s, 'confirm' is {confirm:g} s: "
            "nothing would be known by its end"
        )


def _of_name(spec: ComponentSpec, what: str, confirm: float) -> str:
    """Return why an expression cannot speak of something of a component; empty if it can."""
    if what == ACTIVE or _has_parameter(spec, what):
        return ""
    if what in qualities_of(spec.description):
        return next(_too_short(spec, confirm), "")
    parameters = [parameter.name for parameter in spec.description.parameters] if spec.description else []
    known = (*parameters, *qualities_of(spec.description), ACTIVE)
    return f"{spec.name} has no parameter or measured quality {what!r}; {instead_of(what, known)}"


def _has_parameter(spec: ComponentSpec, name: str) -> bool:
    return spec.description is not None and spec.description.parameter(name) is not None


def _no_quality(spec: ComponentSpec, name: str) -> str:
    if spec.description is not None and spec.description.quality(name) is not None:
        return (
            f"{spec.name} only estimates {name!r}: it measures {', '.join(qualities_of(spec.description)) or 'nothing'}"
        )
    hint = instead_of(name, qualities_of(spec.description), none="it measures none")
    return f"{spec.name} measures no quality {name!r}; {hint}"


def _range(quality: QualityDescription) -> str:
    low, high = ("" if bound is None else f"{bound:g}" for bound in (quality.minimum, quality.maximum))
    return f"{low}..{high} {quality.unit}"
