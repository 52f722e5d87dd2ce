"""A period that cannot be is refused where it is declared; one that a parameter gives stays in bounds."""

from __future__ import annotations

import math

import pytest

from regraft import Component, Parameter, every
from regraft.bus_schema.errors import BadType
from regraft.component.component import describe
from regraft.component.handlers import LONGEST, MAX_RATE, MIN_PERIOD, NEVER, Period
from regraft.runtime.core.timers import Timers


@pytest.mark.parametrize("seconds", [-1.0, 0.0, 1e-9, math.inf, math.nan, 1e10])
def test_seconds_that_cannot_be_are_refused_where_they_are_declared(seconds: float) -> None:
    with pytest.raises(ValueError, match=r"@every\(seconds=.* must be between"):
        every(seconds=seconds)


@pytest.mark.parametrize(("then", "due"), [(-5, 0), (7, 7), (2**70, NEVER)])
def test_a_sleep_is_over_at_a_time_that_clocks_have(then: int, due: int) -> None:
    timers = Timers()
    timers.sleep_until(then)
    assert timers.next_due() == due


@pytest.mark.parametrize("hz", [-1.0, 1e9, math.inf, math.nan])
def test_rates_that_cannot_be_are_refused_where_they_are_declared(hz: float) -> None:
    with pytest.raises(ValueError, match=r"@every\(hz=.* must be between"):
        every(hz=hz)


@pytest.mark.parametrize("attribute", ["checkpoint_every", "handler_timeout", "evaluate_every"])
@pytest.mark.parametrize("seconds", [-1.0, 0.0, 1e-9, math.inf, math.nan])
def test_a_class_with_a_period_that_cannot_be_is_refused_by_name(attribute: str, seconds: float) -> None:
    hasty = type("Hasty", (Component,), {attribute: seconds})
    with pytest.raises(BadType, match=rf"{attribute} = .*: must be between"):
        describe(hasty)


def test_the_default_of_a_parameter_is_looked_at_too() -> None:
    with pytest.raises(ValueError, match="must be between"):

        class Hasty(Component):
            rate = Parameter(1e9, unit="Hz")

            @every(hz=rate)
            def hurry(self) -> None: ...


@pytest.mark.parametrize("value", [-1.0, 0.0, 1e-300, 5e-324, 0.1, 7.0, 1e9, 1e300])
def test_a_value_of_a_parameter_never_leads_beyond_the_bounds(value: float) -> None:
    least, most = MIN_PERIOD * 1e9, LONGEST * 1e9
    given = Parameter(1.0)
    given.name = "period"
    assert least <= Period(given, None).nanoseconds({"period": value}) <= most
    period = Period(None, given).nanoseconds({"period": value})
    assert least <= period <= most if value > 0 else period > most
    if 1 / LONGEST < value < MAX_RATE:
        assert period == round(1e9 / value)
