"""The names of one robot among several: what ports, services and expressions mean by default."""

from __future__ import annotations

import pytest

from regraft.bus_schema.model.architecture import Architecture, ComponentSpec, TopicSpec, scopes_in
from regraft.bus_schema.model.expressions import Expression
from regraft.bus_schema.model.robots.scopes import component_in_scope, in_scope, scope_of
from regraft.component.component import describe
from regraft.stack.sections.components import connections, services
from tests.stack.parts import Navigator, Signals


def with_topics(*names: str, robots: tuple[str, ...] = ()) -> Architecture:
    topics = {name: TopicSpec(name, "regraft/Twist") for name in names}
    return Architecture("site", 0, False, {}, topics, robots=robots)


def test_a_component_is_in_a_scope_if_the_system_has_topics_of_it_or_a_robot_of_that_name() -> None:
    assert scope_of("rescuer.navigator", scopes_in(["map", "rescuer/scan"])) == "rescuer"
    assert scope_of("rescuer.navigator", scopes_in(["map", "rescuers/scan"])) == ""
    assert scope_of("rescuer.navigator", scopes_in(["map"], ["rescuer"])) == "rescuer"
    assert scope_of("navigator", scopes_in(["navigator/scan"], ["navigator"])) == ""


@pytest.mark.parametrize(
    ("scope", "name", "topic", "component"),
    [
        ("rescuer", "scan", "rescuer/scan", "rescuer.scan"),
        ("rescuer", "/map", "map", "map"),
        ("", "scan", "scan", "scan"),
        ("", "/map", "map", "map"),
    ],
)
def test_a_slash_names_what_all_share(scope: str, name: str, topic: str, component: str) -> None:
    assert in_scope(scope, name) == topic
    assert component_in_scope(scope, name) == component


def test_a_component_that_is_added_later_has_the_names_of_its_scope() -> None:
    spec = ComponentSpec("rescuer.helper", description=describe(Navigator))
    known = with_topics("rescuer/odometry", "scan", "smell")
    assert connections(spec, known, {"scan": "scan"}) == {
        "odometry": "rescuer/odometry",
        "scan": "scan",
        "velocity": "rescuer/velocity",
    }
    assert services(spec, known, {}) == {"navigate_to": "rescuer/navigate_to"}
    assert services(spec, known, {"navigate_to": "go"}) == {"navigate_to": "go"}


def test_a_component_that_is_added_to_a_robot_without_topics_has_the_names_of_that_robot() -> None:
    spec = ComponentSpec("rescuer.signals", description=describe(Signals))
    known = with_topics("clock_like", robots=("rescuer",))
    assert services(spec, known, {}) == {"honk": "rescuer/honk"}
    assert connections(spec, known, {}) == {"clock_like": "clock_like"}


def test_the_ports_of_a_robot_without_topics_have_the_topics_of_all() -> None:
    spec = ComponentSpec("rescuer.navigator", description=describe(Navigator))
    known = with_topics("odometry", "scan", "velocity", robots=("rescuer",))
    assert connections(spec, known, {}) == {"odometry": "odometry", "scan": "scan", "velocity": "velocity"}


def test_a_default_topic_may_be_shared() -> None:
    spec = ComponentSpec("rescuer.signals", description=describe(Signals))
    assert connections(spec, with_topics("rescuer/scan", "clock_like"), {}) == {"clock_like": "clock_like"}


def test_names_in_an_expression_are_renamed_and_nothing_else_is() -> None:
    text = "a.rate * 2 <= b.rate\\\n and c.kind == 'a.rate é' or not a.active"
    assert Expression(text).renamed(lambda name: f"left.{name}" if name.startswith("a.") else name) == (
        "left.a.rate * 2 <= b.rate\\\n and c.kind == 'a.rate é' or not left.a.active"
    )
