"""The forecast of an option: the components' own estimates under its parameters, and the utility that follows."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from regraft.adaptation_manager.planners.choices.objective import Evaluation, Objective
from regraft.adaptation_manager.planners.choices.slots import Option
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding.records import record_shape
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.expressions import Expression, Unknown

MAX_ASSUMED: Final = 32


@dataclass(frozen=True, slots=True)
class ForecastKnobs:
    """The inputs of the forecast.

    ``utility`` is an expression for the value of an option. Its names are the estimates of the components that the
    option changes (``navigator.power``) and its own values (``navigator.max_velocity``). Assumptions and the request's
    context have names too. ``assume`` are the expressions that become the context of the components' estimates. They
    are computed for each option from its values and the request's context. An option in force is only changed for one
    that is better by ``margin``.
    """

    utility: str
    assume: dict[str, str] = field(default_factory=dict)
    margin: float = 0.0


@dataclass(frozen=True, slots=True)
class Model:
    """The knobs, read and checked."""

    objective: Objective
    margin: float


def model_of(plain: dict[str, PlainValue]) -> Model:
    """Return the model that knobs describe; raises BadMessage naming what is wrong, and where."""
    knobs: ForecastKnobs = record_shape(ForecastKnobs).unpack(plain)
    if len(knobs.assume) > MAX_ASSUMED:
        raise BadMessage(f"are {len(knobs.assume)}, must be at most {MAX_ASSUMED}", ("assume",))
    try:
        utility = Expression(knobs.utility)
    except BadMessage as error:
        raise error.inside("utility") from None
    assumed = []
    for name, text in knobs.assume.items():
        try:
            assumed.append((name, Expression(text)))
        except BadMessage as error:
            raise error.inside(name).inside("assume") from None
    return Model(Objective(utility, tuple(assumed)), knobs.margin)


@dataclass(frozen=True, slots=True)
class Forecast:
    """An option's expected worth, or why that is unknown."""

    option: Option
    utility: float | None
    why: str = ""


def outlook(evaluation: Evaluation, option: Option) -> Forecast:
    """Return what an option is expected to be worth."""
    try:
        worth = evaluation.value(evaluation.objective.utility, option.selections)
    except Unknown as error:
        return Forecast(option, None, str(error))
    return Forecast(option, worth)
