"""What is to be added is looked at in a process of its own, within bounds."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import Any, cast

import pytest

from regraft.bus.memory_bus import MemoryQuery
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.protocol.control import ControlError
from regraft.bus_schema.messages.protocol.host import DescribeComponent, DescribedComponent
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.host.plan import HostPlan
from regraft.host.zygote.describe_process import be_describer
from regraft.host.zygote.describer import DESCRIBED_TIMEOUT, MAX_AT_ONCE, Describer
from regraft.host.zygote.zygote import Zygote
from regraft.stack.describing import Surroundings, describe_component

CAMERA = "regraft.sim_service.camera_component:Camera"


class Recorded:
    """Stands where the zygote does, and keeps what it is told."""

    def __init__(self) -> None:
        self.orders: dict[str, dict[str, Any]] = {}
        self.signals: list[tuple[int, int]] = []

    def describe(self, name: str, order: dict[str, Any], folder: str, log: str) -> None:
        self.orders[name] = order

    def signal(self, pid: int, signum: int) -> None:
        self.signals.append((pid, signum))


def _asked(folder: Path, cls: str) -> tuple[Recorded, Describer, MemoryQuery, str]:
    zygote = Recorded()
    plan = HostPlan(
        architecture=Architecture("s", 0, simulated=False, components={}, topics={}),
        folder=folder,
        stack_folder=folder,
        run="run",
        endpoint="",
        secret="",
    )
    describer = Describer(cast("Zygote", zygote), plan)
    query = MemoryQuery("k", codec.encode(DescribeComponent(ComponentSpec("new", cls))))
    describer.ask(query)
    return zygote, describer, query, next(iter(zygote.orders))


def test_a_class_is_described_and_no_file_is_left(tmp_path: Path) -> None:
    zygote, describer, query, name = _asked(tmp_path, "tests.host.parts:Ticker")
    assert describer.takes({"started": 7, "name": name})
    assert be_describer(zygote.orders[name]) == 0
    assert describer.takes({"ended": 7, "name": name, "code": 0})
    described = codec.decode(query.answers[0].payload, DescribedComponent)
    assert described.violations == ()
    assert described.spec.description is not None
    assert list(tmp_path.iterdir()) == []


def test_an_import_that_hangs_is_killed_and_that_is_said(tmp_path: Path) -> None:
    zygote, describer, query, name = _asked(tmp_path, "slow:Slow")
    describer.takes({"started": 7, "name": name})
    describer.look(0.0)
    assert zygote.signals == []
    describer.look(float("inf"))
    assert zygote.signals == [(7, signal.SIGKILL)]
    assert describer.takes({"ended": 7, "name": name, "code": -9})
    (problem,) = codec.decode(query.answers[0].payload, ControlError).problems
    assert f"had not done so after {DESCRIBED_TIMEOUT:g} s" in problem


def test_reports_of_components_are_left_alone(tmp_path: Path) -> None:
    _, describer, _, _ = _asked(tmp_path, "slow:Slow")
    assert not describer.takes({"ended": 7, "name": "describe", "code": 0})


def test_a_storm_of_questions_is_bounded(tmp_path: Path) -> None:
    _, describer, query, _ = _asked(tmp_path, "slow:Slow")
    for _ in range(MAX_AT_ONCE - 1):
        describer.ask(query)
    with pytest.raises(BadMessage, match="ask again later"):
        describer.ask(query)


def test_paths_are_those_of_the_host(tmp_path: Path) -> None:
    parameters = {"file": "world.xml", "folder": "$RUN/maps"}
    spec = ComponentSpec("m", "regraft.services.mapper.mapper:Mapper", parameters={"folder": "$RUN/maps"})
    here = Surroundings(tmp_path, "/run")
    assert describe_component(spec, here).spec.parameters == {"folder": "/run/maps"}
    world = ComponentSpec("w", "regraft.sim_service.map_server:MapServer", parameters={"file": parameters["file"]})
    assert describe_component(world, here).spec.parameters == {"file": str(tmp_path / "world.xml")}


def test_references_of_the_stack_have_their_values_and_others_are_named(tmp_path: Path) -> None:
    shared: dict[str, Any] = {"world": "/w.xml", "robots": [{"name": "a"}]}
    references = {"": shared, "a": {"base_height": 0.1, **shared}}

    def described(name: str = "c", cls: str = CAMERA, **parameters: object) -> DescribedComponent:
        spec = ComponentSpec(name, cls, parameters=dict(parameters))
        return describe_component(spec, Surroundings(tmp_path, "/run", references))

    assert described(file="$world", robots="$robots").spec.parameters == {"file": "/w.xml", "robots": [{"name": "a"}]}
    detector = "regraft.services.detector.detector:Detector"
    assert described("a.detector", detector).spec.parameters == {"base_height": 0.1}
    assert described("detector", detector).spec.parameters == {}
    (violation,) = described(file="$wrld").violations
    assert violation.field == "parameters.file"
