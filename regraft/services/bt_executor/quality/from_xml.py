"""Requirements that are written in XML alone."""

from __future__ import annotations

import math
from typing import Any, Final

from behavior_tree import Input, Node, NodeSetup, Status
from behavior_tree.data.values import parse_real
from regraft.services.bt_executor.quality.over_time import Integral, Unknown
from regraft.services.bt_executor.quality.requirement_node import QualityRequirement
from regraft.services.bt_executor.quality.requirement_text import (
    AllOf,
    Comparison,
    Key,
    Requirement,
    operand,
    parse_requirement,
)
from regraft.services.bt_executor.quality.satisfaction_degree import RELATIONS
from regraft.services.bt_executor.quality.system_level import COMBINATIONS, SystemLevelQR, combined
from regraft.services.bt_executor.quality.task_level import TaskLevelQR
from regraft.services.bt_executor.quality.verdict import QualityTeller

BOUNDS: Final = ("at_least", "at_most")
OVER_TIME: Final = ("as_early_as_possible", "as_late_as_possible")
MEASURES: Final = ("value", "integral")


class RequiredInXml(QualityRequirement):
    """Reports in ports what is required: a bound, two bounds, a fuzzy relation, or ``requirement``, a text with several
    of those.

    Each number may be a literal or ``{key}``. Without any of these ports nothing is required: it only measures.
    """

    at_least = Input[Any](default="", description="the least metric that will do")
    at_most = Input[Any](default="", description="the greatest metric that will do")
    as_close_as_possible_to = Input[Any](default="", description="the best metric; needs within")
    as_many_as_possible = Input[Any](default="", description="what will just do; the more the better")
    as_few_as_possible = Input[Any](default="", description="what will just do; the fewer the better")
    as_late_as_possible = Input[Any](default="", description="seconds that will just do; the later the better")
    as_early_as_possible = Input[Any](default="", description="seconds that will just do; the earlier the better")
    within = Input[Any](
        default="", description="tolerance: there the degree of a fuzzy relation is 1/2; bounds get soft by it"
    )
    requirement = Input[Any](default="", description="such as: {@nearest} at least 0.46 or {@speed} at most 0.18")

    def __init__(self, setup: NodeSetup, context: QualityTeller) -> None:
        super().__init__(setup, context)
        self._required: Requirement | None = None

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Take the child and read what is required; see `Node.adopt`."""
        super().adopt(children)
        self._required = self._read_required()

    def _read_required(self) -> Requirement | None:
        given = self.setup.attributes
        relations = [relation for relation in RELATIONS if relation.port in given]
        ports = [relation.port for relation in relations]
        if "requirement" in given:
            if ports or "within" in given:
                raise ValueError(f"'requirement' has everything; leave {', '.join(ports or ['within'])} out")
            return parse_requirement(given["requirement"])
        if "within" in given and not ports:
            raise ValueError("'within' needs something that it is the tolerance of, such as as_close_as_possible_to")
        if len(ports) > 1 and not set(ports) <= set(BOUNDS):
            raise ValueError(f"{' and '.join(ports)} do not go together; use 'requirement' to combine them")
        within = operand(given["within"]) if "within" in given else None
        comparisons = [Comparison(None, relation, self._number(relation.port), within) for relation in relations]
        if len(comparisons) == 2:
            low, high = (comparison.bound for comparison in comparisons)
            if isinstance(low, float) and isinstance(high, float) and low > high:
                raise ValueError(f"at_least {low:g} is more than at_most {high:g}; nothing could satisfy both")
        return AllOf(tuple(comparisons)) if len(comparisons) > 1 else next(iter(comparisons), None)

    def _number(self, port: str) -> float | Key:
        try:
            return operand(self.setup.attributes[port])
        except ValueError as error:
            raise ValueError(f"port '{port}': {error}") from None

    def data_keys(self) -> tuple[str, ...]:
        """Return the entries of the data ports, and those that the requirement's text asks."""
        asked = tuple(key.key for key in self._required.subjects()) if self._required else ()
        return super().data_keys() + asked

    def degree_of(self, metric: float) -> float | None:
        """Return how far the requirement holds, None if there is none."""
        if self._required is None:
            return None
        return self._required.degree(lambda key: metric if key is None else self._value_of(key))

    def _value_of(self, key: Key) -> float:
        return as_number(self.blackboard.get(key.key))

    def own_value(self) -> float:
        """Return the number at the port ``value``."""
        return as_number(self.read_port("value"))


def as_number(value: object) -> float:
    """Return a value as a real number; raises Unknown if it is none."""
    try:
        number = parse_real(value) if isinstance(value, str) else float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        raise Unknown(f"{value!r:.100} is not a number") from None
    if math.isnan(number):
        raise Unknown("it is not a number")
    return number


class PlainTaskQR(RequiredInXml, TaskLevelQR):
    """A requirement of a task, written in XML alone.

        <TaskLevelQR name="MoveQuickly" quality_attribute="MovementEfficiency" value="{@speed}"
                     as_close_as_possible_to="0.26" within="0.08" stale_after="1" metric="{@quickness}"> …

    The metric is ``value``, or with ``measure="integral"`` its integral over the seconds since the child began. That is
    also the last metric of the run. Without a value, ``as_early_as_possible`` and ``as_late_as_possible`` measure the
    seconds since the child began.
    """

    value = Input[Any](description="what is measured, a number")
    measure_as = Input(str, name="measure", default="value", description="value, or integral: its sum over seconds")

    def __init__(self, setup: NodeSetup, context: QualityTeller) -> None:
        super().__init__(setup, context)
        self._began = 0.0
        self._integral = Integral(0.0)

    def required_ports(self) -> tuple[str, ...]:
        """Return ``value``, unless the time is measured."""
        return () if self._measures_time() else ("value",)

    def _measures_time(self) -> bool:
        given = self.setup.attributes
        return "value" not in given and any(port in given for port in OVER_TIME)

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Take the child and check the ports; see `Node.adopt`."""
        super().adopt(children)
        if not self.has_literal("measure") and "measure" in self.setup.attributes:
            raise ValueError("port 'measure' must be a literal: value or integral")
        if self.measure_as not in MEASURES:
            raise ValueError(f"port 'measure' is '{self.measure_as}'; it must be one of {', '.join(MEASURES)}")
        if self._measures_time() and "measure" in self.setup.attributes:
            raise ValueError("port 'measure' needs a value to measure")

    def on_start(self) -> None:
        """Note when the run begins."""
        self._began = self.now()
        self._integral = Integral(self._began, self.stale_after or math.inf)

    def measure(self) -> float | None:
        """Return the value, its integral, or the time since the run began."""
        if self._measures_time():
            return self.now() - self._began
        value = self.own_value()
        return self._integral.add(value, self.now()) if self.measure_as == "integral" else value

    def on_end(self, status: Status) -> float | None:
        """Return the whole time or integral; a value stays as it was."""
        return self.measure() if self._measures_time() or self.measure_as == "integral" else None


class PlainSystemQR(RequiredInXml, SystemLevelQR):
    """A requirement of the system, written in XML alone.

        <SystemLevelQR name="Endurance" quality_attribute="Power" combine="sum" value="{@idle_power}" at_most="8"> …

    ``combine`` makes one number of the metrics of the task-level requirements that are active below. The system's own
    ``value``, if there is one, weighs 1. Without ``combine`` the value is the metric.
    """

    value = Input[Any](description="the system's own share, a number")
    combine = Input(str, default="", description=f"how to combine metrics: {', '.join(COMBINATIONS)}")

    def required_ports(self) -> tuple[str, ...]:
        """Return ``value`` if it is given."""
        return ("value",) if "value" in self.setup.attributes else ()

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Take the child and check the ports; see `Node.adopt`."""
        if not {"value", "combine"} & set(self.setup.attributes):
            raise ValueError(f"{self.type_id} needs a value, or combine for the metrics of the tasks below, or both")
        super().adopt(children)
        if self.has_literal("combine") and self.combine not in COMBINATIONS:
            raise ValueError(f"port 'combine' is '{self.combine}'; it must be one of {', '.join(COMBINATIONS)}")

    def measure(self) -> float | None:
        """Return the combination, or the value."""
        own = [(self.own_value(), 1.0)] if "value" in self.setup.attributes else []
        if "combine" not in self.setup.attributes:
            return own[0][0]
        return combined(own + self.gathered_metrics(), self.combine)
