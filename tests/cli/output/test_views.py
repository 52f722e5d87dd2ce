"""The JSON of what is seen of components and topics, field by field."""

from __future__ import annotations

import pytest

from regraft.bus_schema.messages.health import ComponentStatus
from regraft.bus_schema.messages.protocol.host import ProcessState, ProcessStatus
from regraft.bus_schema.model.architecture import ComponentSpec, TopicSpec
from regraft.bus_schema.model.description import ANY_TYPE, Description, PortDescription, ServiceDescription
from regraft.bus_schema.model.lifecycle import State
from regraft.cli.outcomes import BadInput
from regraft.cli.system.ps import plain_component
from regraft.cli.topology import Topology
from regraft.client import ComponentSeen

STATUS = ComponentStatus("arm", 3, State.INACTIVE, 7, 1.5, "no power", 2, 1, "waits", {"url": "here"})
PROCESS = ProcessStatus("arm", 4, ProcessState.RUNNING, 4711, 2, 1.0, "exit code 1")


def test_a_component_of_which_nothing_is_known_is_shown_without_values() -> None:
    assert plain_component(ComponentSeen("arm", False, None, None, None, None)) == {
        "name": "arm",
        "alive": False,
        "state": None,
        "incarnation": None,
        "host": None,
        "process": None,
        "pid": None,
        "restarts": 0,
        "exit_reason": "",
        "revision": None,
        "silent_s": None,
        "lost": 0,
        "refused": 0,
        "error": "",
        "failure": "",
        "detail": "",
        "values": {},
    }


def test_a_component_is_shown_by_its_status_and_its_process() -> None:
    shown = {
        "name": "arm",
        "alive": True,
        "state": "inactive",
        "incarnation": 4,
        "host": "edge",
        "process": "running",
        "pid": 4711,
        "restarts": 2,
        "exit_reason": "exit code 1",
        "revision": 7,
        "silent_s": 0.123,
        "lost": 2,
        "refused": 1,
        "error": "no power",
        "failure": "",
        "detail": "waits",
        "values": {"url": "here"},
    }
    assert plain_component(ComponentSeen("arm", True, STATUS, 0.12345, "edge", PROCESS)) == shown
    alone = {"host": None, "process": None, "pid": None, "restarts": 0, "exit_reason": "", "incarnation": 3}
    assert plain_component(ComponentSeen("arm", True, STATUS, 0.12345, None, None)) == shown | alone
    waits = plain_component(
        ComponentSeen("arm", False, None, None, "edge", ProcessStatus("arm", 0, ProcessState.WAITING))
    )
    assert (waits["incarnation"], waits["pid"], waits["process"]) == (0, None, "waiting")


def port(name: str, direction: str, kind: str = "regraft/Twist") -> PortDescription:
    return PortDescription(name, direction, kind, 1, name)


def spec(name: str, *ports: PortDescription, **connections: str) -> ComponentSpec:
    description = Description("m:C", "", ports, services=(ServiceDescription("stop", "service", "a/A", "b/B"),))
    return ComponentSpec(
        name, "m:C", connections={**connections}, services={"stop": f"{name}/stop"}, description=description
    )


def test_topics_are_shown_with_all_their_ends_and_what_the_stack_says_of_them() -> None:
    recorder = spec("a_recorder", port("any", "input", ANY_TYPE), any="speed")
    wheels = spec("wheels", port("speed", "input"), port("odometry", "output"), speed="speed")
    pilot = spec("pilot", port("speed", "output"), port("spare", "output"), speed="speed", spare="")
    unmanaged = ComponentSpec("program", command=("true",))
    topics = {"map": TopicSpec("map", "regraft/Map", reliable=False, rate=2.0)}
    found = Topology({"wheels": wheels, "program": unmanaged}, {"a_recorder": recorder, "pilot": pilot}, topics).uses()
    assert [use.plain() for use in found.values()] == [
        {"name": "map", "type": "regraft/Map", "reliable": False, "rate": 2.0, "writers": [], "readers": []},
        {
            "name": "speed",
            "type": "regraft/Twist",
            "reliable": None,
            "rate": None,
            "writers": ["pilot.speed"],
            "readers": ["wheels.speed", "a_recorder.any"],
        },
    ]


def test_offers_are_shown_under_the_names_that_the_stack_gives_them() -> None:
    known = Topology({"pilot": spec("pilot")}, {"arm": spec("arm")}, {})
    assert [offer.plain() for offer in known.offers("service").values()] == [
        {
            "name": f"{name}/stop",
            "kind": "service",
            "component": name,
            "request": "a/A",
            "reply": "b/B",
            "feedback": None,
            "goals": 0,
            "description": "",
        }
        for name in ("arm", "pilot")
    ]
    assert known.offers("action") == {}


def two_robots() -> Topology:
    """Return a pilot of each of two robots, a world, and topics of both and of all."""
    pilots = {
        f"{robot}.pilot": spec(
            f"{robot}.pilot", port("speed", "output"), port("wind", "input"), speed=f"{robot}/speed", wind="wind"
        )
        for robot in ("left", "right")
    }
    world = spec("world", port("left/scan", "output"), **{"left/scan": "left/scan"})
    names = ("left/speed", "right/speed", "left/scan", "wind", "light")
    return Topology({"world": world, **pilots}, {}, {name: TopicSpec(name, "regraft/Twist") for name in names})


def test_a_view_by_robot_has_its_components_their_offers_and_the_topics_of_its_name_or_its_use() -> None:
    left = two_robots().of_robot("left")
    assert list(left.components) == ["left.pilot"]
    assert list(left.offers("service")) == ["left.pilot/stop"]
    assert list(left.uses()) == ["left/scan", "left/speed", "wind"]
    assert [left.view.has_component(f"{robot}.added_later") for robot in ("left", "right")] == [True, False]
    assert left.uses()["left/scan"].writers == [("world", "left/scan")]
    assert left.uses()["wind"].readers == [("left.pilot", "wind"), ("right.pilot", "wind")]
    assert two_robots().of_robot("") == two_robots()


def test_an_unknown_robot_is_a_mistake_with_the_nearest_name() -> None:
    with pytest.raises(BadInput, match="there is no robot 'lft'; did you mean 'left'"):
        two_robots().of_robot("lft")
