"""The modes of one robot among several, by the command line: ``--robot`` is whose mode is meant."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from regraft import Component, Parameter, service
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.management.modes import MODES, ModesRequest, PartModes, SystemModes
from regraft.bus_schema.model.adaptation import ADAPT, AdaptationReport, AdaptationRequest, EnterMode, Outcome
from regraft.bus_schema.model.architecture import Architecture, TopicSpec
from regraft.bus_schema.model.modes.mode_parts import PartKind
from tests.cli.away.test_ended import running
from tests.cli.live import regraft
from tests.gateway.parts import HostStub
from tests.support.stepped.site import Site

NAMES = ("slow", "rescuer/slow", "talker.fast", "rescuer/talker.fast")
SLOWER: dict[str, PlainValue] = {"change": "set_parameters", "component": "talker", "parameters": {"rate": 10.0}}
TOPIC = TopicSpec("rescuer/numbers", "regraft/Twist")


class Talker(Component):
    """Has modes."""

    rate = Parameter(20.0)


class Keeper(Component):
    """Keeps what it is asked for."""

    def __init__(self) -> None:
        self.asked: list[AdaptationRequest] = []

    @service(ADAPT)
    def adapt(self, request: AdaptationRequest) -> AdaptationReport:
        """Do nothing."""
        self.asked.append(request)
        return AdaptationReport("2", Outcome.APPLIED, request, 1, 2, 1.0)

    @service(MODES)
    def modes(self, request: ModesRequest) -> SystemModes:
        """Name the parts."""
        parts = (PartModes(name, PartKind.COMPONENT) for name in ("talker", "rescuer.talker"))
        return SystemModes(1.0, 1, tuple(parts))


@pytest.fixture
def robots(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Keeper, Path]]:
    """Run a robot and what all share, with modes of the same names; returns what is asked for, and the home."""
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path))
    over = threading.Event()
    site = Site("zenoh")
    try:
        keeper = site.start(Keeper, "adaptation_manager")
        site.start(Talker, "talker")
        site.start(Talker, "rescuer.talker", scope="rescuer")
        host = HostStub(site.session(), site.keys)
        modes: dict[str, PlainValue] = {name: [SLOWER] for name in NAMES}
        host.architecture = Architecture("site", 1, False, {}, {TOPIC.name: TOPIC}, modes=modes)
        with running(site, over):
            yield keeper, tmp_path
        host.close()
    finally:
        over.set()
        site.close()


@pytest.mark.parametrize(
    ("words", "entered"),
    [
        (("slow", "--robot", "rescuer"), "rescuer/slow"),
        (("rescuer/slow", "--robot", "rescuer"), "rescuer/slow"),
        (("talker.fast", "--robot", "rescuer"), "rescuer/talker.fast"),
        (("slow",), "slow"),
    ],
    ids=str,
)
def test_the_mode_of_the_robot_is_entered(robots: tuple[Keeper, Path], words: tuple[str, ...], entered: str) -> None:
    keeper, home = robots
    done = regraft(home, "mode", *words)
    assert done.returncode == 0, done
    assert [request.changes for request in keeper.asked] == [(EnterMode(entered),)]


@pytest.mark.parametrize("words", [("slow",), ("show",), ("list",)], ids=str)
def test_a_robot_that_is_not_there_is_a_mistake(robots: tuple[Keeper, Path], words: tuple[str, ...]) -> None:
    keeper, home = robots
    done = regraft(home, "mode", *words, "--robot", "rescuar")
    assert (done.returncode, "did you mean 'rescuer'?" in done.stderr) == (2, True)
    assert keeper.asked == []


def test_a_part_of_the_robot_is_shown_by_its_short_name(robots: tuple[Keeper, Path]) -> None:
    _, home = robots
    for name in ("talker", "rescuer.talker"):
        shown = json.loads(regraft(home, "mode", "show", name, "--robot", "rescuer", "--json").stdout)
        assert [part["part"] for part in shown] == ["rescuer.talker"]
