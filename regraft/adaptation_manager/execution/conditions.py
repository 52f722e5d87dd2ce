"""Judges the conditions of an adaptation that is being confirmed by what its components answer."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from regraft.adaptation_manager.execution.measured import MeasuredSince
from regraft.adaptation_manager.targets.component_client import ControlFailed
from regraft.adaptation_manager.targets.context import ExecutionContext
from regraft.bus_schema.messages.protocol.control import ComponentView
from regraft.bus_schema.model.constraints import split_parameter
from regraft.bus_schema.model.expressions import Expression, Unknown
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.watch_checks import qualities_of
from regraft.bus_schema.model.watched import BreachCode, Condition


@dataclass(frozen=True, slots=True)
class Verdict:
    """Whether a condition holds, None if that is unknown; ``code`` and ``text`` are why it does not."""

    holds: bool | None
    code: BreachCode = BreachCode.REQUIREMENT_BROKEN
    text: str = ""
    component: str = ""
    value: float | None = None


def parts_of(condition: Condition) -> list[tuple[str, str]]:
    """Return each component that a condition is about, with what of it: a name, empty for its state."""
    if condition.require:
        return [split_parameter(name) for name in Expression(condition.require).names]
    if condition.quality:
        return [split_parameter(condition.quality)]
    return [(condition.component, "")] if condition.component else []


@dataclass(slots=True)
class Readings:
    """The answers of the components of some conditions at one look."""

    context: ExecutionContext
    measured: MeasuredSince = field(default_factory=MeasuredSince)
    views: dict[str, ComponentView | str] = field(default_factory=dict)

    async def read(self, conditions: Iterable[Condition], *, old: bool = False) -> None:
        """Ask the components of all conditions; what is measured by now counts for nothing later if it is ``old``."""
        controls, now = self.context.controls, self.context.kit.now()
        viewed: set[str] = set()
        wanted: set[str] = set()
        for condition in conditions:
            for name, what in parts_of(condition):
                (wanted if condition.quality or self._is_quality(name, what) else viewed).add(name)
        asked = {name: controls.read(name) for name in sorted(viewed)}
        measuring = {name: controls.read_qualities(name) for name in sorted(wanted)}
        self.views.clear()
        for name, viewing in asked.items():
            try:
                self.views[name] = await viewing.view()
            except ControlFailed as error:
                self.views[name] = str(error)
        for name, waiting in measuring.items():
            try:
                self.measured.take(name, await waiting.qualities(), now, old=old)
            except ControlFailed as error:
                self.measured.take(name, str(error), now, old=old)

    def judge(self, condition: Condition) -> Verdict:
        """Return whether a condition about components holds."""
        if condition.quality:
            return self._judge_quality(condition)
        return self._judge_expression(condition) if condition.require else self._judge_state(condition)

    def value(self, name: str) -> Any:
        """Return the value of a name of an expression; raises Unknown."""
        component, what = split_parameter(name)
        if self._is_quality(component, what):
            return self.measured.value(component, what, self.context.kit.now())
        is_parameter = self._has_parameter(component, what)
        if not is_parameter and self.context.controls.living(component) is None:
            return False
        view = self.views.get(component, "it was not asked")
        if isinstance(view, str):
            raise Unknown(f"{name} is unknown: {view}")
        if not is_parameter:
            return view.state is State.ACTIVE
        if what not in view.parameters:
            raise Unknown(f"{name} is unknown: {component} has no such parameter")
        return view.parameters[what]

    def _has_parameter(self, component: str, what: str) -> bool:
        spec = self.context.after.components.get(component)
        return spec is not None and spec.description is not None and spec.description.parameter(what) is not None

    def _is_quality(self, component: str, what: str) -> bool:
        spec = self.context.after.components.get(component)
        return spec is not None and not self._has_parameter(component, what) and what in qualities_of(spec.description)

    def _judge_quality(self, condition: Condition) -> Verdict:
        component, name = split_parameter(condition.quality)
        try:
            value = self.measured.value(component, name, self.context.kit.now())
        except Unknown as error:
            return Verdict(None, BreachCode.QUALITY_UNKNOWN, f"the quality {error}", component)
        least, most = condition.bounds
        holds = (least is None or value >= least) and (most is None or value <= most)
        unit = qualities_of(self.context.after.components[component].description)[name].unit
        shown = f"{value:g}" if unit == "1" else f"{value:g} {unit}"
        text = f"the quality {condition.quality} is {shown}, must be {condition.wanted}"
        return Verdict(holds, BreachCode.QUALITY_OUT_OF_BOUNDS, text, component, value)

    def _judge_state(self, condition: Condition) -> Verdict:
        name, process = condition.component, self.context.controls.processes.get(condition.component)
        if self.context.controls.living(name) is None:
            why = process.exit_reason if process else "it has no process"
            return Verdict(False, BreachCode.ENDED, f"{name} has ended: {why}", name)
        view = self.views[name]
        if isinstance(view, str):
            return Verdict(False, BreachCode.NO_ANSWER, view, name)
        text = f"{name} is {view.state.value}, must be {condition.wanted}"
        return Verdict(view.state is condition.state, BreachCode.WRONG_STATE, text, name)

    def _judge_expression(self, condition: Condition) -> Verdict:
        names = _Names(self)
        try:
            holds = bool(Expression(condition.require).value(names))
        except Unknown as error:
            return Verdict(None, BreachCode.EXPRESSION_UNKNOWN, f"{condition.require!r}: {error}")
        now = ", ".join(f"{name} is {_shown(value)}" for name, value in names.items())
        return Verdict(holds, BreachCode.EXPRESSION_FALSE, f"{condition.require!r} must be true, but {now}")


def _shown(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else repr(value)


class _Names(dict[str, Any]):
    """The values that an expression has asked for."""

    def __init__(self, readings: Readings) -> None:
        super().__init__()
        self._readings = readings

    def __missing__(self, name: str) -> Any:
        """Look a value up; raises Unknown."""
        self[name] = self._readings.value(name)
        return self[name]
