"""A parameter takes what its description says, in the type of its default."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pytest

from regraft import Component, Parameter, ParameterError, Records
from regraft.bus_schema.errors import BadType
from regraft.bus_schema.model.parameter_values import parameter_problem
from regraft.component.component import parameter_set


def declared(default: Any, **more: Any) -> Parameter[Any]:
    parameter: Parameter[Any] = Parameter(default, **more)
    parameter.__set_name__(Parameter, "knob")
    return parameter


class Mover(Component):
    """Moves no faster than it can."""

    fastest = Parameter(1.0, minimum=0.1, unit="m/s", read_only=True, from_robot="max_velocity")
    speed = Parameter(0.8, minimum=0.0, unit="m/s", limit="fastest")


class Cautious(Component):
    """Has bounds of its own besides what the robot can do."""

    fastest = Parameter(0.5, minimum=0.0, read_only=True)
    beams = Parameter(5.5, read_only=True)
    speed = Parameter(0.2, minimum=0.1, maximum=0.26, unit="m/s", limit="fastest")
    rays = Parameter(7, limit="beams")


class Boundless(Component):
    """Has a limit that there is not."""

    speed = Parameter(0.8, limit="fastst")
    fastest = Parameter(1.0, read_only=True)


@pytest.mark.parametrize(("fastest", "default"), [(2.0, 0.8), (0.8, 0.8), (0.5, 0.5)])
def test_a_limit_is_the_maximum_and_keeps_the_default(fastest: float, default: float) -> None:
    parameters = parameter_set(Mover, {"fastest": fastest})
    assert parameters.values["speed"] == default
    parameters.set({"speed": fastest})
    with pytest.raises(ParameterError, match=f"must be at most {fastest} m/s"):
        parameters.set({"speed": fastest + 0.01})


def test_a_limit_leaves_a_smaller_maximum_as_it_is() -> None:
    with pytest.raises(ParameterError, match=r"4\.0: must be at most 0\.26 m/s"):
        parameter_set(Cautious, {"fastest": 5.0, "speed": 4.0})


def test_a_limit_of_a_whole_number_is_a_whole_number() -> None:
    parameters = parameter_set(Cautious, {})
    assert parameters.values["rays"] == 5
    assert parameters.declared["rays"].describe().schema["maximum"] == 5


def test_a_limit_below_the_least_value_is_refused_by_its_own_name() -> None:
    with pytest.raises(ParameterError) as refused:
        parameter_set(Cautious, {"fastest": 0.05})
    ((name, why),) = refused.value.parts
    assert name == "fastest"
    assert "0.05: must be at least 0.1 m/s, the least of 'speed'" in why


def test_a_limit_that_the_class_lacks_is_refused() -> None:
    with pytest.raises(BadType, match=r"'speed': its limit 'fastst' must be a read-only.*did you mean 'fastest'"):
        parameter_set(Boundless, {})


@pytest.mark.parametrize(
    ("default", "given", "taken"),
    [(1.0, 2, 2.0), ((1.0,), [2.5], (2.5,)), ((), ["a", 1], ("a", 1)), (True, False, False), ("a", "b", "b")],
)
def test_a_value_is_taken_in_the_type_of_the_default(default: Any, given: Any, taken: Any) -> None:
    found = declared(default).checked(given)
    assert (found, type(found)) == (taken, type(taken))


@pytest.mark.parametrize(
    ("parameter", "given", "told"),
    [
        (declared(0.1, maximum=0.26, unit="m/s"), 0.3, "knob: 0.3: must be at most 0.26 m/s"),
        (declared(1), 2.0, "knob: 2.0: must be an integer"),
        (declared(1), True, "knob: True: must be an integer"),
        (declared(1.0), float("nan"), "knob: nan: must be finite and fit into 64 bits"),
        (declared((1.0,)), [float("inf")], "knob: [inf]: must be finite and fit into 64 bits"),
        (declared((1.0,), minimum=0.0), [1.0, -1.0], "knob: [1.0, -1.0]: must be at least 0.0"),
        (declared(()), [{}], "knob: [{}]: must be an array of numbers and strings"),
        (declared("a", choices=("a", "b")), "c", "knob: 'c': must be one of: a, b"),
    ],
)
def test_a_value_that_does_not_fit_is_refused_and_shown(parameter: Parameter[Any], given: Any, told: str) -> None:
    with pytest.raises(ParameterError) as failure:
        parameter.checked(given)
    assert str(failure.value) == told


def test_a_default_of_another_type_is_refused() -> None:
    with pytest.raises(TypeError, match="default is of type NoneType, must be of bool, int, float, str, tuple"):
        declared(None)


@dataclass(frozen=True, slots=True)
class Beacon:
    """Flashes."""

    at: float
    colour: str = "red"


def test_records_that_are_written_as_a_text_are_refused_with_their_form() -> None:
    told = parameter_problem(Records(Beacon).describe(), "30 red, 60 green")
    assert told == "'30 red, 60 green': must be an array such as [{at: ..., colour: ...}]"


def test_records_of_a_schedule_are_in_order_and_may_be_at_one_time() -> None:
    records = Records(Beacon, in_order_of="at")
    records.__set_name__(Component, "beacons")
    assert len(records.checked([{"at": at, "colour": "red"} for at in (1.0, 2.0, 2.0)])) == 3
    with pytest.raises(ParameterError, match=r"beacons\.2\.at: 30 comes after 60: put the records in order"):
        records.checked([{"at": at, "colour": "red"} for at in (10.0, 60.0, 30.0)])


def test_records_cannot_be_in_order_of_a_field_that_there_is_not() -> None:
    with pytest.raises(TypeError, match="Beacon has no field 'when' to be in order of"):
        Records(Beacon, in_order_of="when")
