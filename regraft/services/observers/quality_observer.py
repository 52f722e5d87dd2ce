"""The observer of qualities and contexts: publishes them as expressions over what components measure."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final

from regraft import Component, Input, Level, Output, Parameter, ParameterError, Records, State, every
from regraft.bus_schema.annotations import PlainValue, Text
from regraft.bus_schema.encoding.reading_checks import ValueKind
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.health import Diagnostic
from regraft.bus_schema.messages.management.objectives import CONTEXT_STATUS, QUALITY_STATUS
from regraft.bus_schema.messages.management.system import SystemFaults, SystemMeasurements, SystemStates
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.description import Resources
from regraft.bus_schema.model.expressions import Expression, Unknown
from regraft.bus_schema.model.robots.scopes import scope_of
from regraft.services.observers.observed_qualities import checked_expression, read_observed_qualities
from regraft.services.observers.situation import Situation, name_problems
from regraft.stack.yaml.problems import StackError

CONTEXT: Final = "context"
"""The key of a context's name in a diagnostic."""


@dataclass(frozen=True, slots=True)
class MeasuredQuality:
    """A quality as an expression; of one objective, or of all where ``objective`` is empty."""

    quality: Annotated[str, Text(200)]
    measured: Annotated[str, Text(2000)]
    objective: Annotated[str, Text(200)] = ""

    def __post_init__(self) -> None:
        if not self.quality:
            raise BadMessage("is empty: must be the name of a quality", ("quality",))
        _, problems = checked_expression(self.measured, ValueKind.NUMBER)
        if problems:
            raise BadMessage(problems[0], ("measured",))


@dataclass(frozen=True, slots=True)
class ContextCondition:
    """A context, and the condition under which it is the present one."""

    context: Annotated[str, Text(200)]
    when: Annotated[str, Text(2000)]

    def __post_init__(self) -> None:
        if not self.context:
            raise BadMessage("is empty: must be the name of a context", ("context",))
        _, problems = checked_expression(self.when, ValueKind.TRUTH, constant=True)
        if problems:
            raise BadMessage(problems[0], ("when",))


@dataclass(frozen=True, slots=True)
class _Measured:
    """A quality with its expression, where it is written, and the objective that it is one of."""

    quality: str
    objective: str
    expression: Expression
    where: str
    place: str = ""

    @property
    def key(self) -> tuple[str, str]:
        return self.quality, self.objective

    @property
    def subject(self) -> str:
        return f"{self.quality} of {self.objective}" if self.objective else self.quality


class QualityObserver(Component):
    """Publishes ``QA status`` diagnostics with measured qualities, and ``Context status`` with the present context.

    A quality that is not known is not published; why it is not known is among the component's diagnostics. The first
    context whose condition has held for ``settle`` is published when it is another than before. It is published again
    when a component becomes active, which may not have heard it. A condition that is not known does not hold. Where
    none holds, the context stays.
    """

    resources = Resources(cpu=0.01, memory=25.0)

    observed = Parameter("", "the generated observed_qualities.yaml", unit="path", read_only=True, exists=True)
    qualities = Records(MeasuredQuality, "further qualities, also those of single objectives")
    contexts = Records(ContextCondition, "contexts and their conditions; the first that holds counts")
    period = Parameter(0.5, "time between two measurements", minimum=0.05, maximum=3600.0, unit="s")
    settle = Parameter(0.5, "how long a context has to hold first", minimum=0.0, maximum=3600.0, unit="s")

    states = Input(SystemStates, topic="system/states", latest_only=True)
    faults = Input(SystemFaults, topic="system/faults", latest_only=True)
    measurements = Input(SystemMeasurements, topic="system/measurements", latest_only=True)
    diagnostics = Output(Diagnostic, description="measured qualities, and the context")

    def __init__(self) -> None:
        self._stale: tuple[SystemStates | None, SystemFaults | None] = (None, None)

    @classmethod
    def check_parameters(cls, parameters: dict[str, Any], seed: int) -> None:
        """Find what is wrong with the file, and qualities that are given twice."""
        every_quality = _measured(parameters)
        known: set[tuple[str, str]] = set()
        problems = []
        for each in every_quality:
            if each.key in known:
                problems.append((each.where, f"the quality {each.subject!r} is given twice: leave one out"))
            known.add(each.key)
        if problems:
            raise ParameterError(problems)

    @classmethod
    def check_architecture(cls, name: str, parameters: dict[str, Any], architecture: Architecture) -> None:
        """Find names in expressions that are not there."""
        scope = scope_of(name, architecture.scopes)
        problems = [
            (each.where, f"{each.place}{problem}")
            for each in _measured(parameters)
            for problem in name_problems(each.expression, scope, architecture, ValueKind.NUMBER)
        ]
        problems += [
            (f"contexts.{index}.when", problem)
            for index, context in enumerate(parameters["contexts"])
            for problem in name_problems(Expression(context.when), scope, architecture, ValueKind.TRUTH)
        ]
        if problems:
            raise ParameterError(problems)

    def on_configure(self) -> None:
        """Read what is measured; raises ParameterError."""
        given = {"observed": self.observed, "qualities": self.qualities}
        self._qualities = tuple(_measured(given))
        self._conditions = tuple((each.context, Expression(each.when)) for each in self.contexts)

    def on_activate(self) -> None:
        """Begin without a context, and without anything that is unknown."""
        self._unknown: dict[str, str] = {}
        self._context = self._candidate = ""
        self._candidate_since = self.kit.now()
        self._active: frozenset[tuple[str, int]] = frozenset()

    def on_deactivate(self) -> None:
        """Note what was read last: it may be wrong by the next activation."""
        self._stale = (self.states.latest, self.faults.latest)

    @every(seconds=period)
    def observe(self) -> None:
        """Publish the qualities that are known, and the context if it is another."""
        now = self.kit.now()
        states = None if self.states.latest is self._stale[0] else self.states.latest
        faults = None if self.faults.latest is self._stale[1] else self.faults.latest
        situation = Situation(self.kit.scope, now, states, faults, self.measurements.latest)
        for each in self._qualities:
            try:
                value = each.expression.number(situation)
            except Unknown as why:
                self._note(each.subject, str(why))
                continue
            self._note(each.subject, "")
            self._publish(now, each.objective, QUALITY_STATUS, {each.quality: value})
        self._see_context(situation, repeats=self._see_activations(states))

    def _see_activations(self, states: SystemStates | None) -> bool:
        """Return whether runs of components have become active since the last look."""
        if states is None:
            return False
        active = {(each.component, each.incarnation) for each in states.components if each.state is State.ACTIVE}
        before, self._active = self._active, frozenset(active)
        return not active <= before

    def _see_context(self, situation: Situation, *, repeats: bool) -> None:
        now, found = situation.now, ""
        for context, condition in self._conditions:
            try:
                holds = condition.value(situation)
            except Unknown as why:
                self._note(f"context {context}", str(why))
                continue
            self._note(f"context {context}", "")
            if holds and not found:
                found = context
        if found != self._candidate:
            self._candidate, self._candidate_since = found, now
        if found and found != self._context and now - self._candidate_since >= self.settle:
            self._context, repeats = found, True
        if repeats and self._context:
            self._publish(now, "", CONTEXT_STATUS, {CONTEXT: self._context})

    def _note(self, subject: str, why: str) -> None:
        """Report once why something is not known, and once that it is known again."""
        if bool(why) == (subject in self._unknown):
            return
        if why:
            self._unknown[subject] = why
            self.kit.diagnose(subject, Level.WARNING, why)
        else:
            del self._unknown[subject]
            self.kit.diagnose(subject, Level.OK, "known again")

    def _publish(self, now: float, subject: str, text: str, values: dict[str, PlainValue]) -> None:
        assert all(not isinstance(value, float) or math.isfinite(value) for value in values.values())
        self.diagnostics.publish(Diagnostic(now, self.kit.name, subject, Level.OK, text, values))


def _measured(parameters: dict[str, Any]) -> list[_Measured]:
    """Return all qualities that parameters ask for; raises ParameterError for a file that is wrong."""
    return [*_of_file(parameters["observed"]), *_of_records(parameters["qualities"])]


def _of_file(file: str) -> Iterator[_Measured]:
    if not file:
        return
    try:
        found = read_observed_qualities(Path(file))
    except StackError as error:
        raise ParameterError([("observed", str(problem)) for problem in error.problems]) from None
    for quality, (expression, location) in found.items():
        yield _Measured(quality, "", expression, "observed", f"{location}: {quality}: ")


def _of_records(records: tuple[MeasuredQuality, ...]) -> Iterator[_Measured]:
    for index, each in enumerate(records):
        where = f"qualities.{index}.measured"
        yield _Measured(each.quality, each.objective, Expression(each.measured), where)
