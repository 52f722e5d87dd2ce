"""A class declares its qualities, and its description has them; what cannot be one is refused where it is written."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import pytest

from regraft import Component, Parameter, Quality
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadType, SchemaError
from regraft.bus_schema.model.description import Description
from regraft.bus_schema.model.qualities.qualities import Better, QualityDescription
from regraft.component.component import describe
from tests.qualities.parts import Gauge, Plain


def test_a_description_has_the_qualities_with_unit_direction_and_range() -> None:
    level, cost = describe(Gauge).qualities
    assert level == QualityDescription("level", "m", Better.HIGHER, 0.0, 1.0, True, True, True, "of the tank")
    assert (cost.name, cost.better, cost.functional, cost.measured) == ("cost", Better.LOWER, False, False)


def test_a_description_with_qualities_travels_on_the_bus() -> None:
    described = describe(Gauge)
    assert codec.decode(codec.encode(described), Description) == described
    assert described.evaluate_every == 0.5


def test_a_class_that_measures_nothing_has_no_period() -> None:
    assert describe(Plain).qualities == ()
    assert describe(Plain).evaluate_every is None


def test_a_subclass_inherits_and_replaces_qualities() -> None:
    class Other(Gauge):
        level = Quality("of the pond", unit="m", better="lower")
        extra = Quality()

    described = describe(Other)
    assert [quality.name for quality in described.qualities] == ["level", "cost", "extra"]
    assert described.qualities[0].better is Better.LOWER


def test_qualities_may_depend_on_read_only_parameters() -> None:
    class Pumps(Component):
        count = Parameter(1, minimum=1, maximum=9, read_only=True)

        @classmethod
        def qualities_for(cls, parameters: dict[str, Any]) -> Iterable[Quality]:
            return [Quality(unit="m3/s", name=f"flow_{number}") for number in range(parameters["count"])]

    assert [quality.name for quality in describe(Pumps, {"count": 2}).qualities] == ["flow_0", "flow_1"]


def test_two_qualities_cannot_share_a_name() -> None:
    class Twice(Component):
        one = Quality(name="power")
        other = Quality(name="power")

    with pytest.raises(BadType, match="two qualities have the name 'power'"):
        describe(Twice)


def test_a_quality_cannot_have_a_name_that_is_too_long() -> None:
    class Long(Component):
        long = Quality(name="q" * 129)

    with pytest.raises(SchemaError, match="cannot name a quality"):
        describe(Long)


@pytest.mark.parametrize("period", [0.0, -1.0, math.nan, math.inf])
def test_a_class_cannot_measure_all_the_time_or_never_by_a_number(period: float) -> None:
    class Restless(Gauge):
        evaluate_every = period

    with pytest.raises(BadType, match=r"evaluate_every = .*: must be between 0.01 and 1e\+09 s, or None"):
        describe(Restless)


def test_a_quality_cannot_take_the_place_of_a_hook() -> None:
    with pytest.raises(BadType, match=r"test_declaring.py:\d+: 'snapshot' cannot name a quality"):

        class Wrong(Component):
            snapshot = Quality()  # type: ignore[assignment]


@pytest.mark.parametrize(
    ("given", "problem"),
    [
        ({"better": "more"}, "better='more': must be one of higher, lower, neither"),
        ({"minimum": 2.0, "maximum": 1.0}, "minimum=2: must be at most maximum=1"),
        ({"minimum": math.nan}, "minimum=nan: must be a finite number"),
        ({"maximum": math.inf}, "maximum=inf: must be a finite number"),
        ({"measured": False, "estimated": False}, "one of them must give the quality"),
    ],
)
def test_a_quality_that_makes_no_sense_is_refused(given: dict[str, Any], problem: str) -> None:
    with pytest.raises(ValueError, match=problem):
        Quality(**given)
