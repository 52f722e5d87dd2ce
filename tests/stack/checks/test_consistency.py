"""Every violation of an architecture is found, whoever made it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft import Parameter
from regraft.bus_schema.model.adaptation import Violation
from regraft.bus_schema.model.architecture import (
    Architecture,
    ComponentSpec,
    Constraint,
    ConstraintKind,
    HostRules,
    TopicSpec,
    Writers,
)
from regraft.bus_schema.model.consistency import value_violations, violations
from regraft.bus_schema.model.description import (
    Description,
    ParameterDescription,
    PortDescription,
    Resources,
    ServiceDescription,
)
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.parameter_values import parameter_problem
from regraft.component.parameters import ParameterError

IMAGE = "test/Image"


def camera(name: str, topic: str = "image", *, version: int = 1, state: State = State.ACTIVE) -> ComponentSpec:
    """Return a component that writes images, and serves them, and holds a device."""
    description = Description(
        "cameras:Camera",
        "",
        (PortDescription("image", "output", IMAGE, version, "image"),),
        (ParameterDescription("rate", 5.0, {"type": "number", "minimum": 0.0, "maximum": 30.0}, "Hz"),),
        (ServiceDescription("look", "service", "test/Look", "test/Seen"),),
        resources=Resources(devices=("/dev/video0",)),
    )
    return ComponentSpec(
        name,
        "cameras:Camera",
        host=f"host-of-{name}",
        connections={"image": topic},
        services={"look": f"{name}/look"},
        state=state,
        description=description,
    )


def detector(*, state: State = State.ACTIVE, required: bool = True) -> ComponentSpec:
    """Return a component that reads images."""
    ports = (PortDescription("image", "input", IMAGE, 1, "image", required),)
    description = Description("eyes:Detector", "", ports)
    return ComponentSpec(
        "detector", "eyes:Detector", connections={"image": "image"}, state=state, description=description
    )


def system(
    *specs: ComponentSpec, writers: Writers = Writers.ONE, constraints: tuple[Constraint, ...] = ()
) -> Architecture:
    """Return an architecture of these components."""
    topics = [
        TopicSpec("image", IMAGE, writers=writers),
        TopicSpec("spare", IMAGE),
        TopicSpec("scan", "test/Scan"),
    ]
    hosts = ("local", *(f"host-of-{spec.name}" for spec in specs))
    components = {spec.name: spec for spec in specs}
    rules = {host: HostRules(devices=("/dev/video0",)) for host in hosts}
    return Architecture("test", 1, False, components, {t.name: t for t in topics}, hosts, constraints, host_rules=rules)


def found(architecture: Architecture) -> list[tuple[str, str]]:
    """Return component and field of all violations."""
    return [(violation.component, violation.field) for violation in violations(architecture)]


def only(architecture: Architecture) -> Violation:
    """Return the only violation."""
    (violation,) = violations(architecture)
    return violation


def test_consistent_architecture_has_no_violations() -> None:
    assert violations(system(camera("eye"), detector())) == ()


def test_reader_of_an_idle_writer_is_unfed() -> None:
    violation = only(system(camera("eye", state=State.INACTIVE), detector()))
    assert (violation.component, violation.field, violation.change) == ("detector", "connect.image", None)
    assert "activate one of 'eye' (inactive)" in violation.problem


@pytest.mark.parametrize("reader", [detector(state=State.INACTIVE), detector(required=False)])
def test_reader_that_is_idle_or_needs_nothing_may_be_unfed(reader: ComponentSpec) -> None:
    assert violations(system(camera("eye", "spare"), reader)) == ()


def test_versions_of_both_ends_must_agree() -> None:
    violation = only(system(camera("eye", version=2), detector()))
    assert violation.field == "connect.image"
    assert "takes version 1 of test/Image, but 'eye' writes version 2" in violation.problem


def test_wrong_type_is_told_with_the_topics_that_would_do() -> None:
    violation = only(system(camera("eye", "scan")))
    assert violation.problem == (
        "output 'image' gives test/Image, but topic 'scan' carries test/Scan; "
        "topics that carry test/Image: image, spare"
    )


def test_standby_writer_may_share_the_topic_of_an_active_one() -> None:
    assert violations(system(camera("eye"), camera("spare_eye", state=State.INACTIVE), detector())) == ()


def test_two_active_writers_share_a_topic_only_if_it_takes_many() -> None:
    eyes = (camera("left"), camera("right"))
    assert found(system(*eyes)) == [("left", "connect.image"), ("right", "connect.image")]
    assert violations(system(*eyes, writers=Writers.MANY)) == ()


def test_output_must_be_connected() -> None:
    violation = only(system(replace(camera("eye"), connections={})))
    assert violation.problem.startswith(
        "output 'image' is required, but is connected to no topic; topics that carry test/Image"
    )


def test_service_offered_twice_is_told_even_of_idle_components() -> None:
    right = replace(camera("right", "spare", state=State.INACTIVE), services={"look": "left/look"})
    assert found(system(camera("left"), right)) == [("left", "services.look"), ("right", "services.look")]


def test_device_is_held_by_one_component_of_a_host() -> None:
    left, right = camera("left"), replace(camera("right", "spare"), host="host-of-left")
    assert found(system(left, right)) == [("left", "resources.devices"), ("right", "resources.devices")]
    assert violations(system(left, replace(right, state=State.UNCONFIGURED))) == ()


def test_device_is_only_where_a_host_has_it() -> None:
    left = camera("left")
    rules = {"host-of-left": HostRules(devices=("/dev/vido0",)), "local": HostRules(devices=("/dev/video0",))}
    violation = only(replace(system(left), host_rules=rules))
    assert (violation.component, violation.field) == ("left", "resources.devices")
    assert violation.problem == (
        "needs /dev/video0 for itself, and host 'host-of-left' has none: name it under hosts.host-of-left.devices; "
        "did you mean '/dev/vido0'?; offered by: local"
    )
    assert violations(replace(system(replace(left, state=State.UNCONFIGURED)), host_rules={})) == ()


def test_unknown_host_and_wrong_key_are_told() -> None:
    eye = replace(camera("eye"), host="moon")
    architecture = replace(system(eye), components={"ear": eye})
    assert found(architecture) == [("ear", "name"), ("ear", "host")]


def test_managed_component_without_description_is_told() -> None:
    assert found(system(replace(camera("eye"), description=None))) == [("eye", "description")]


def test_transition_state_cannot_be_wanted() -> None:
    assert ("eye", "state") in found(system(camera("eye", state=State.ACTIVATING)))


@pytest.mark.parametrize(
    ("kind", "states", "kept"),
    [
        (ConstraintKind.AT_LEAST_ONE_ACTIVE, (State.ACTIVE, State.INACTIVE), True),
        (ConstraintKind.AT_LEAST_ONE_ACTIVE, (State.INACTIVE, State.UNCONFIGURED), False),
        (ConstraintKind.AT_MOST_ONE_ACTIVE, (State.INACTIVE, State.ACTIVE), True),
        (ConstraintKind.AT_MOST_ONE_ACTIVE, (State.ACTIVE, State.ACTIVE), False),
    ],
)
def test_activity_constraints_count_active_components(
    kind: ConstraintKind, states: tuple[State, State], kept: bool
) -> None:
    rule = Constraint(kind, ("left", "right"), because="the robot must see")
    eyes = camera("left", state=states[0]), camera("right", "spare", state=states[1])
    problems = violations(system(*eyes, constraints=(rule,)))
    assert [violation.field for violation in problems] == ([] if kept else ["constraints.0"])
    assert all(violation.problem.endswith("because the robot must see") for violation in problems)


@pytest.mark.parametrize(("rate", "kept"), [(None, True), (4.0, True), (10.0, False), (1.0, False)])
def test_parameter_constraint_holds_for_default_and_given_values(rate: float | None, kept: bool) -> None:
    rule = Constraint(ConstraintKind.PARAMETER, parameter="eye.rate", minimum=2.0, maximum=6.0)
    eye = replace(camera("eye"), parameters={} if rate is None else {"rate": rate})
    assert found(system(eye, constraints=(rule,))) == ([] if kept else [("eye", "parameters.rate")])


def test_several_violations_are_all_told() -> None:
    eye = replace(
        camera("eye"),
        host="moon",
        parameters={"rate": 99.0, "rat": 1},
        connections={"image": "nowhere", "x": "scan"},
    )
    assert sorted(found(system(eye, detector()))) == [
        ("detector", "connect.image"),
        ("eye", "connect.image"),
        ("eye", "connect.x"),
        ("eye", "host"),
        ("eye", "parameters.rat"),
        ("eye", "parameters.rate"),
    ]


VALUE = st.one_of(st.floats(-5.0, 40.0), st.text(max_size=3), st.booleans(), st.none())


@given(
    values=st.dictionaries(st.sampled_from(["rate", "rat"]), VALUE),
    sick=st.booleans(),
    limits=st.tuples(st.floats(0.0, 10.0), st.floats(10.0, 20.0)),
)
def test_what_new_values_break_is_found_by_looking_at_values_alone(
    values: dict[str, Any], sick: bool, limits: tuple[float, float]
) -> None:
    rule = Constraint(ConstraintKind.PARAMETER, parameter="eye.rate", minimum=limits[0], maximum=limits[1])
    eye = replace(camera("eye"), host="moon" if sick else "host-of-eye")
    before = system(eye, detector(), constraints=(rule,))
    after = system(replace(eye, parameters=values), detector(), constraints=(rule,))
    everything = set(violations(after)) - set(violations(before))
    assert set(value_violations(after, {"eye"})) - set(value_violations(before, {"eye"})) == everything


def _parameters() -> list[Parameter[Any]]:
    declared: dict[str, Parameter[Any]] = {
        "number": Parameter(1.0, minimum=0.0, maximum=5.0),
        "integer": Parameter(1, maximum=3),
        "text": Parameter("a", choices=("a", "b")),
        "flag": Parameter(False),
        "numbers": Parameter((1.0,), minimum=0.0),
        "mixed": Parameter(()),
    }
    for name, parameter in declared.items():
        parameter.__set_name__(Parameter, name)
    return list(declared.values())


@given(
    st.sampled_from(_parameters()),
    st.none()
    | st.booleans()
    | st.integers(-10, 10)
    | st.floats(width=32)
    | st.sampled_from(["a", "b", "c"])
    | st.lists(st.floats(-5, 5) | st.sampled_from(["a", {}, [1.0]]), max_size=3),
)
def test_value_fits_a_description_as_it_fits_the_component(parameter: Parameter[Any], value: object) -> None:
    try:
        parameter.checked(value)
        fits = True
    except ParameterError:
        fits = False
    assert (parameter_problem(parameter.describe(), value) is None) == fits
