"""Conditions under which a component that works is unfit all the same, such as an empty battery."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Annotated

from regraft.bus_schema.annotations import Text
from regraft.bus_schema.encoding.reading_checks import ValueKind
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.expressions import Expression, Unknown
from regraft.services.observers.observed_qualities import checked_expression
from regraft.services.observers.situation import Situation, name_problems


@dataclass(frozen=True, slots=True)
class ComponentCondition:
    """When a component counts as failed, and when it has recovered; between both nothing changes.

    Both are expressions over what components measure, such as ``battery.charge < 0.5``. Where both hold, the component
    counts as failed. ``recovered`` may be a constant: with ``"False"`` a failure is for good.
    """

    component: Annotated[str, Text(200)]
    failed: Annotated[str, Text(2000)]
    recovered: Annotated[str, Text(2000)]

    def __post_init__(self) -> None:
        if not self.component:
            raise BadMessage("is empty: must be the name of a component", ("component",))
        for field, constant in (("failed", False), ("recovered", True)):
            _, problems = checked_expression(getattr(self, field), ValueKind.TRUTH, constant=constant)
            if problems:
                raise BadMessage(problems[0], (field,))


def condition_problems(
    conditions: Iterable[ComponentCondition], scope: str, architecture: Architecture
) -> Iterator[tuple[str, str]]:
    """Return the fields of conditions whose names are not there, and what is wrong with them."""
    for index, condition in enumerate(conditions):
        for field in ("failed", "recovered"):
            expression = Expression(getattr(condition, field))
            for problem in name_problems(expression, scope, architecture, ValueKind.TRUTH):
                yield f"conditions.{index}.{field}", problem


class Fitness:
    """Whether one component is unfit by one condition, as far as is known."""

    def __init__(self, condition: ComponentCondition) -> None:
        self.text = condition.failed
        self.unfit = False
        self._failed = Expression(condition.failed)
        self._recovered = Expression(condition.recovered)

    def see(self, situation: Situation) -> None:
        """Take in how things are; what is not known changes nothing."""
        if _holds(self._failed, situation):
            self.unfit = True
        elif self.unfit and _holds(self._recovered, situation):
            self.unfit = False


def _holds(expression: Expression, situation: Situation) -> bool:
    try:
        return bool(expression.value(situation))
    except Unknown:
        return False
