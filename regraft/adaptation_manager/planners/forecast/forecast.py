"""The forecast of an option: the components' own estimates under its parameters, and the utility that follows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from regraft.adaptation_manager.planners.choices.settings import Kind
from regraft.adaptation_manager.planners.choices.slots import Option, Slot
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding.records import record_shape
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.expressions import Expression, Unknown
from regraft.process.main import NoSuchClass, load_class

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

    utility: Expression
    assume: tuple[tuple[str, Expression], ...]
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
    return Model(utility, tuple(assumed), knobs.margin)


@dataclass(frozen=True, slots=True)
class Forecast:
    """An option's expected worth, or why that is unknown."""

    option: Option
    utility: float | None
    why: str = ""


def outlook(
    model: Model,
    slots: Sequence[Slot],
    option: Option,
    architecture: Architecture,
    context: Mapping[str, float],
) -> Forecast:
    """Return what an option is expected to be worth in an architecture, the context being what is known."""
    known: dict[str, PlainValue] = dict(context)
    for slot, value in zip(slots, option.values, strict=True):
        if isinstance(value, int | float | str):
            known[slot.name] = value
    assumed: dict[str, PlainValue] = {}
    try:
        for name, expression in model.assume:
            assumed[name] = known[name] = expression.value(known)
        for component in dict.fromkeys(setting.component for setting in option.settings):
            spec = architecture.components[component]
            changed = {
                setting.member: setting.value
                for setting in option.settings
                if setting.component == component and setting.kind is Kind.PARAMETER
            }
            estimated = estimates(spec, changed, assumed)
            known |= {f"{component}.{quality}": value for quality, value in estimated.items()}
        return Forecast(option, model.utility.number(known))
    except Unknown as error:
        return Forecast(option, None, str(error))


def estimates(
    spec: ComponentSpec, changed: Mapping[str, PlainValue], context: Mapping[str, PlainValue]
) -> dict[str, float]:
    """Return what a component's class expects to give, with some parameters changed; raises Unknown."""
    described = spec.description.parameters if spec.description else ()
    parameters = {parameter.name: parameter.default for parameter in described} | spec.parameters | dict(changed)
    try:
        return load_class(spec.cls).estimate(parameters, dict(context))
    except NoSuchClass as error:
        raise Unknown(f"{spec.name}: {error}") from None
    except (ArithmeticError, KeyError, TypeError, ValueError) as error:
        raise Unknown(f"{spec.name} cannot estimate: {type(error).__name__}: {error}") from None
