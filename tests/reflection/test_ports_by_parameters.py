"""A class may give a component further ports by its parameters; they are ports like all others."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.protocol.control import ParameterValues
from regraft.bus_schema.messages.sensors import LightLevel
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.component.component import class_path, describe
from regraft.component.parameters import ParameterError
from regraft.testing import Rig
from tests.reflection.parts import Ear, Listener

LEFT = {"name": "left", "topic": "near"}
RIGHT = {"name": "right", "topic": "far", "loudness": 1.0}


def names(parameters: dict[str, Any]) -> list[str]:
    """Return the names of the ports that a listener has."""
    return [port.name for port in describe(Listener, parameters).ports]


def test_a_description_lists_the_ports_that_the_parameters_ask_for() -> None:
    assert names({}) == ["told"]
    assert names({"ears": [LEFT, RIGHT], "prefix": "my_"}) == [
        *("my_left", "my_right", "told"),
        *("my_left_echo", "my_right_echo"),
    ]
    left = describe(Listener, {"ears": [LEFT]}).port("left")
    assert left is not None
    assert (left.topic, left.type, left.origin) == ("near", "regraft/LightLevel", "ears.0")


def test_such_ports_carry_messages() -> None:
    with Rig() as rig:
        listener = rig.add(Listener, parameters={"ears": [LEFT, RIGHT]}, connections={"right": "elsewhere"})
        near, far = rig.collect("near/echo", LightLevel), rig.collect("far/echo", LightLevel)
        rig.publish("near", LightLevel(0.0, 0.5))
        rig.publish("elsewhere", LightLevel(0.0, 0.75))
        rig.advance(1.0)
        assert [message.darkness for message in near] == [0.25]
        assert [message.darkness for message in far] == [0.75]
        assert listener.ears == (Ear("left", "near"), Ear("right", "far", 1.0))
        assert not hasattr(listener, "left"), "what a parameter names must not hide what the class has"


def test_records_are_shown_as_they_were_given_and_their_schema_describes_them() -> None:
    with Rig() as rig:
        rig.add(Listener, parameters={"ears": [LEFT, RIGHT]})
        shown = rig.runtimes["listener"].parameters.plain()["ears"]
    assert shown == [{**LEFT, "loudness": 0.5}, RIGHT]
    schema = describe(Listener).parameter("ears")
    assert schema is not None
    Draft202012Validator(schema.schema).validate(shown)
    assert not Draft202012Validator(schema.schema).is_valid([{"name": "left"}])
    assert codec.decode(codec.encode(ParameterValues({"ears": shown})), ParameterValues).values["ears"] == shown


@pytest.mark.parametrize(
    ("ears", "problem"),
    [
        (3, "ears: must be a list of records, is int"),
        ([LEFT, 3], "ears.1: is int, must be a map with the fields of Ear"),
        ([{"name": "left"}], "ears.0.topic: is missing"),
        ([{**LEFT, "loudness": 2}], "ears.0.loudness: is 2.0, must be at most 1.0"),
        ([{**LEFT, "size": 2}], "ears.0: has no field 'size'; Ear has: loudness, name, topic"),
        ([LEFT, LEFT], "ears.1: ears.0 asks for a port 'left' already: each needs a name of its own"),
        ([{**LEFT, "name": "told"}], "ears.0: the class has a port 'told' already: each needs a name of its own"),
    ],
)
def test_parameters_that_ask_for_what_cannot_be_are_refused(ears: Any, problem: str) -> None:
    with pytest.raises(ParameterError) as refused:
        describe(Listener, {"ears": ears})
    assert refused.value.problems[0] == problem
    with Rig() as rig, pytest.raises(ParameterError):
        rig.add(Listener, parameters={"ears": ears})


def test_everything_wrong_with_records_is_told_at_once() -> None:
    with pytest.raises(ParameterError) as refused:
        describe(Listener, {"ears": [{**LEFT, "loudness": 2}, LEFT, {"name": "x"}]})
    assert [problem.split(":")[0] for problem in refused.value.problems] == ["ears.0.loudness", "ears.2.topic"]


ANYTHING = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=3),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.sampled_from(("name", "topic", "loudness", "x")), inner, max_size=4)
    ),
    max_leaves=12,
)


@given(ANYTHING)
def test_whatever_is_given_as_records_is_taken_or_refused(ears: Any) -> None:
    try:
        described = describe(Listener, {"ears": ears})
    except ParameterError:
        return
    assert len(described.ports) == 1 + 2 * len(ears)


def test_ports_by_parameters_survive_where_descriptions_travel_by_class() -> None:
    plain, one, two = (describe(Listener, {"ears": ears}) for ears in ([], [LEFT], [LEFT, RIGHT]))
    before = ComponentSpec("listener", class_path(Listener), parameters={"ears": [LEFT]}, description=one)
    for known in (before, replace(before, description=plain), replace(before, description=two)):
        for now in (before, replace(before, parameters={"ears": [LEFT, RIGHT]}, description=two)):
            sent = now.brief(known)
            assert sent.described_as(known) == now
            assert (sent.description is None) == (now.description == known.description)
