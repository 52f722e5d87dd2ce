"""The overviews field by field, made of an architecture and of what is seen."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, cast

import pytest

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.records import record_shape
from regraft.bus_schema.messages.health import ComponentStatus
from regraft.bus_schema.messages.protocol.clock import ClockTime
from regraft.bus_schema.messages.protocol.host import ProcessState, ProcessStatus
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.lifecycle import State
from regraft.client import Client, ComponentSeen, HostSeen
from regraft.dashboard_api.backend.manager import Manager
from regraft.dashboard_api.backend.overview import Overview
from regraft.dashboard_api.http.problems import NOT_FOUND, Problem
from tests.gateway.parts import robot

STATUS = ComponentStatus("navigator", 3, State.INACTIVE, 7, 1.5, "no map", 2, 1, "waits", {"url": "here"})
PROCESS = ProcessStatus("navigator", 4, ProcessState.RUNNING, 4711, 2, 1.0, "exit code 1")
QUARANTINED = replace(PROCESS, component="arm", state=ProcessState.QUARANTINED, pid=0)


@dataclass
class Stub:
    """Stands for the client and for the manager."""

    seen: dict[str, ComponentSeen] = field(default_factory=dict)
    architecture: Architecture | None = None
    system: str = "site"

    def components(self, wait: float) -> dict[str, ComponentSeen]:
        return self.seen

    def hosts(self, wait: float) -> dict[str, HostSeen]:
        return {"local": HostSeen("local", True, None, 0.5)}

    def clock(self) -> ClockTime | None:
        return None

    def last_architecture(self) -> Architecture | None:
        return self.architecture

    @property
    def is_silent(self) -> bool:
        return self.architecture is None

    @property
    def overview(self) -> Overview:
        return Overview(cast("Client", self), cast("Manager", self))


def plain(view: Any) -> Any:
    cls: Any = type(view)
    return record_shape(cls).pack(view)


def line(**changes: Any) -> dict[str, Any]:
    unknown = dict.fromkeys(("class", "host", "desired", "state", "incarnation", "age", "pid", "restarts"))
    return {**unknown, "alive": False, "error": "", "failure": "", "detail": "", "values": {}, **changes}


SEEN = {
    "arm": ComponentSeen("arm", False, None, None, "edge", QUARANTINED),
    "navigator": ComponentSeen("navigator", True, STATUS, 0.25, "edge", PROCESS),
    "visitor": ComponentSeen("visitor", True, replace(STATUS, error=""), 0.5, None, None),
}


def test_a_component_is_shown_as_it_should_be_and_as_it_is() -> None:
    shown = plain(Stub(SEEN, robot()).overview.components())
    said = {"state": "inactive", "incarnation": 3, "detail": "waits", "values": {"url": "here"}}
    spec = {"host": "local", "desired": "active"}
    navigator = {**said, "host": "edge", "alive": True, "age": 0.25, "pid": 4711, "restarts": 2, "error": "no map"}
    assert shown == {
        "revision": 1,
        "components": [
            line(name="arm", host="edge", pid=0, restarts=2),
            line(name="drive", **{**spec, "class": "tests.gateway.parts:Drive"}),
            line(name="navigator", **{**spec, **navigator, "class": "tests.gateway.parts:Navigator"}),
            line(name="visitor", **said, alive=True, age=0.5),
        ],
    }
    silent = plain(Stub(SEEN).overview.components())
    assert silent["revision"] is None
    assert silent["components"][1] == line(name="navigator", **navigator)


def test_the_system_counts_states_and_names_every_problem() -> None:
    shown = plain(Stub(SEEN, robot()).overview.system())
    assert shown == {
        "system": "site",
        "revision": 1,
        "simulated": False,
        "clock": None,
        "components": {"gone": 1, "inactive": 2},
        "hosts": ["local"],
        "problems": [
            "arm is quarantined: exit code 1",
            "navigator: no map",
            "drive should be active, but is not there",
        ],
    }
    silent = plain(Stub().overview.system())
    assert (silent["revision"], silent["simulated"]) == (None, None)
    assert silent["problems"] == ["the adaptation manager does not answer"]


def test_topics_are_shown_with_their_ends() -> None:
    assert plain(Stub(SEEN, robot()).overview.topics()) == {
        "revision": 1,
        "topics": [
            {
                "name": "velocity",
                "type": "regraft/Twist",
                "reliable": True,
                "rate": 20.0,
                "writers": ["navigator.velocity"],
                "readers": ["drive.velocity"],
            }
        ],
    }


def test_a_component_that_is_not_seen_is_shown_by_its_spec() -> None:
    details = Stub({}, robot()).overview.component("drive")
    assert plain(details) == {
        "name": "drive",
        "alive": False,
        "age": None,
        "spec": codec.to_plain(robot().components["drive"]),
        "status": None,
        "process": None,
        "now": None,
    }


def test_components_and_topics_are_listed_by_robot() -> None:
    known = robot()
    specs = {
        name: replace(known.components[name.rpartition(".")[2]], name=name, connections={"velocity": topic})
        for name, topic in (("left.drive", "left/velocity"), ("right.navigator", "wind"), ("drive", "velocity"))
    }
    topics = {
        name: replace(known.topics["velocity"], name=name)
        for name in ("left/velocity", "left/scan", "right/scan", "wind", "velocity")
    }
    seen = {name: ComponentSeen(name, alive=True) for name in ("right.navigator", "left.visitor")}
    overview = Stub(seen, replace(known, components=specs, topics=topics)).overview
    listed = {name: [line.name for line in overview.components(name).components] for name in ("", "left", "right")}
    assert listed == {
        "": ["drive", "left.drive", "left.visitor", "right.navigator"],
        "left": ["left.drive", "left.visitor"],
        "right": ["right.navigator"],
    }
    assert [line.name for line in overview.topics("right").topics] == ["right/scan", "wind"]
    for asked in (overview.components, overview.topics):
        with pytest.raises(Problem, match="there is no robot 'rihgt'; did you mean 'right'") as refused:
            asked("rihgt")
        assert refused.value.kind is NOT_FOUND
