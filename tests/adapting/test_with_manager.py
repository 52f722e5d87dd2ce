"""Executor, adaptation manager and components, all of them real: rejection, rollback, silence; and simulated time."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from regraft.adaptation_manager.planners.bandits.bandit_planner import BanditPlanner
from regraft.bus.memory_bus import MemoryHub
from regraft.bus_schema.messages.mission import Command, MissionCommand, MissionRequest, MissionState, MissionStatus
from regraft.bus_schema.messages.protocol.control import Snapshot
from regraft.bus_schema.model.adaptation import AdaptationReport, Outcome
from regraft.bus_schema.model.architecture import Architecture, TopicSpec
from regraft.services.bt_executor.executor import Executor
from tests.adaptation import parts
from tests.adaptation.conftest import bare_system  # noqa: F401
from tests.adaptation.host_stub import HostStub
from tests.adaptation.parts import Collector, Keeper, Ticker
from tests.adaptation.system import SYSTEM, System, spec_of
from tests.support.waiting import PATIENCE, wait_until

ENDED = (MissionState.SUCCEEDED, MissionState.FAILED)
WORK = "<Sleep msec='50'/>"


def tree(*nodes: str) -> str:
    return f'<root BTCPP_format="4"><BehaviorTree ID="Main"><Sequence>{"".join(nodes)}</Sequence></BehaviorTree></root>'


def adapting(node_type: str, ports: str, child: str = WORK) -> str:
    return f'<{node_type} name="adapt" {ports} outcome="{{o}}" reason="{{r}}">{child}</{node_type}>'


@pytest.fixture
def system(bare_system: System, monkeypatch: pytest.MonkeyPatch) -> System:  # noqa: F811
    """All components, an executor and a planner among them, and a manager."""
    for cls in (Executor, BanditPlanner):
        monkeypatch.setattr(parts, cls.__name__, cls, raising=False)
    system = bare_system
    system.host.specs["bt_executor"] = spec_of("bt_executor", Executor, parameters={"rate": 100.0, "autostart": False})
    system.host.specs["bandits"] = spec_of("bandits", BanditPlanner)
    for name in ("bt_executor", "bandits"):
        system.start(name)
    system.start_manager()
    return system


@pytest.fixture
def run(system: System) -> Callable[..., MissionStatus]:
    """Run missions on the executor; returns the status at the end."""

    def status() -> MissionStatus:
        return system.client.call("mission/status", MissionRequest(), MissionStatus, PATIENCE)

    def mission(*nodes: str, until: Callable[[MissionStatus], bool] = lambda now: now.state in ENDED) -> MissionStatus:
        for command in (MissionCommand(Command.LOAD, tree(*nodes)), MissionCommand(Command.START)):
            system.client.call("mission/command", command, MissionStatus, PATIENCE)
        wait_until(lambda: until(status()))
        return status()

    return mission


def told(report: AdaptationReport) -> tuple[Any, ...]:
    return report.outcome, report.request.actor, report.request.reason


def test_a_rule_adapts_a_real_component_and_the_journal_says_why(
    system: System,
    run: Callable[..., MissionStatus],
) -> None:
    rule = "level > 3 : listener.gain -= 0.2 within [0.0, 1.0]"
    ended = run('<Script code="level := 4"/>', adapting("AdaptOnStart", f'rules="{rule}"'))
    assert (ended.state, ended.blackboard["o"]) == (MissionState.SUCCEEDED, "applied")
    assert system.view("listener").parameters["gain"] == pytest.approx(0.3)
    (line, *_) = system.lines().entries
    assert told(line) == (Outcome.APPLIED, "adapt", rule)
    assert line.request.context == {"node": "adapt", "rule": rule}


def test_a_rejection_a_rollback_and_silence_are_what_the_author_says(
    system: System,
    run: Callable[..., MissionStatus],
) -> None:
    rejected = run(adapting("AdaptOnStart", 'rules="listener.gain := 7"'))
    assert (rejected.state, rejected.blackboard["o"]) == (MissionState.SUCCEEDED, "rejected")
    assert "must be at most 1" in rejected.blackboard["r"]
    failed = run(adapting("AdaptOnSuccess", 'rules="listener.gain := 7" on_rejected="fail"'))
    assert failed.state is MissionState.FAILED

    broken = run(
        adapting("AdaptOnStart", "rules=\"fragile.mood := 'refuses'\""),
        adapting("AdaptOnSuccess", 'rules="listener.gain := 0.1, fragile.level := 5"'),
    )
    assert (broken.state, broken.blackboard["o"]) == (MissionState.SUCCEEDED, "rolled_back")
    assert "not in this mood" in broken.blackboard["r"]
    assert system.view("listener").parameters["gain"] == 0.5

    system.running["manager"].kill()
    silent = run(adapting("AdaptOnFailure", 'rules="listener.gain := 0.1" timeout="200ms"', "<AlwaysFailure/>"))
    assert (silent.state, silent.blackboard["o"]) == (MissionState.FAILED, "no_answer")
    silent = run(adapting("AdaptOnStart", 'rules="listener.gain := 0.1" timeout="200ms" on_no_answer="fail"'))
    assert (silent.state, silent.blackboard["o"]) == (MissionState.FAILED, "no_answer")


def test_a_rule_is_confirmed_by_conditions_and_the_tree_learns_what_broke(
    system: System,
    run: Callable[..., MissionStatus],
) -> None:
    quiet = """confirm="300ms" watch='json:[{"require": "listener.gain &lt; 0.8"}]'"""
    loud = run(adapting("AdaptOnStart", f'rules="listener.gain := 0.9" {quiet}'))
    assert (loud.state, loud.blackboard["o"]) == (MissionState.SUCCEEDED, "rolled_back")
    assert "must be true, but listener.gain is 0.9" in loud.blackboard["r"]
    assert system.view("listener").parameters["gain"] == 0.5
    assert run(adapting("AdaptOnStart", f'rules="listener.gain := 0.7" {quiet}')).blackboard["o"] == "applied"
    assert system.view("listener").parameters["gain"] == 0.7


def test_a_manager_that_comes_back_is_asked_again(
    system: System,
    run: Callable[..., MissionStatus],
) -> None:
    system.running["manager"].kill()
    ports = 'rules="listener.gain := 0.1" timeout="300ms" on_no_answer="retry 1000" retry_after="10ms"'
    run(adapting("AdaptOnStart", ports), until=lambda now: now.blackboard.get("o") == "no_answer")
    system.start_manager("second")
    wait_until(lambda: system.view("listener").parameters["gain"] == 0.1)


# --- simulated time ---


def _simulated_run(folder: Path) -> list[Any]:
    """Run a periodic plan in simulated time; returns the first lines that it gave the journal."""
    folder.mkdir()
    (folder / "mission.xml").write_text(
        tree(
            '<Script code="up := 1"/>',
            "<KeepRunningUntilFailure><AdaptPeriodically name='adapt' adaptation_period='700ms' "
            "rules='up == 1 : listener.gain += 0.1 within [0, 1]; up == 0 : listener.gain -= 0.2 within [0, 1]'>"
            "<Sequence><Sleep msec='1500'/><Script code='up = 1 - up'/></Sequence>"
            "</AdaptPeriodically></KeepRunningUntilFailure>",
        )
    )
    specs = [
        spec_of("ticker", Ticker, parameters={"speed": "max"}),
        spec_of("listener", parts.Listener, connections={"heard": "count", "hint": "echo"}),
        spec_of("collector", Collector),
        spec_of("keeper", Keeper),
        spec_of("bt_executor", Executor, parameters={"mission": str(folder / "mission.xml")}),
    ]
    topics = {name: TopicSpec(name, "regraft/Twist") for name in ("count", "echo")}
    architecture = Architecture(SYSTEM, 1, True, {spec.name: spec for spec in specs}, topics)
    hub = MemoryHub()
    simulated = System(hub, architecture, HostStub(hub, architecture), folder / "journal.sqlite")
    simulated.start_manager()
    try:
        for name in ("listener", "collector", "keeper", "bt_executor", "ticker"):
            simulated.start(name)
        wait_until(lambda: len(simulated.lines().entries) > 8)
        lines = reversed(simulated.lines(limit=500).entries)
        return [(line.tick, line.started, line.outcome, line.request) for line in lines][:8]
    finally:
        simulated.end()


def test_under_simulated_time_the_same_adaptations_happen_in_the_same_ticks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(parts, "Executor", Executor, raising=False)
    first = _simulated_run(tmp_path / "one")
    assert {outcome for _, _, outcome, _ in first} == {Outcome.APPLIED}
    assert _simulated_run(tmp_path / "two") == first


# --- a real planner ---


def test_a_real_planner_is_asked_and_credited(
    system: System,
    run: Callable[..., MissionStatus],
) -> None:
    ports = (
        'adaptation_strategy="ucb1" adaptation_subject="gain" subject_location="listener" '
        'adaptation_options="0.1;0.2;0.3" adaptation_period="300ms" settle="10ms" '
        'utility="worth" knobs=\'json:{"high": 2}\''
    )
    child = "<KeepRunningUntilFailure><Sleep msec='50'/></KeepRunningUntilFailure>"

    def learned() -> list[float]:
        """Return what each option was found to be worth so far, on the knobs' range of 0 to 2."""
        snapshot = system.client.control("bandits", "state", timeout=PATIENCE)
        assert isinstance(snapshot, Snapshot)
        of_each = snapshot.state["adapt"]["learned"]["ucb1"][1]
        return [mean for _, mean, _ in of_each.values()]

    run(
        '<Script code="worth := 1.5"/>',
        adapting("AdaptPeriodically", ports, child),
        until=lambda now: len(system.lines().entries) > 3 and learned() == [0.75] * 3,
    )
    lines = [line for line in system.lines().entries if line.request.changes and line.outcome is not Outcome.PENDING]
    assert {line.outcome for line in lines} == {Outcome.APPLIED}
    assert all(line.request.actor.startswith("adapt") for line in lines)
    assert all(line.request.context["node"] == "adapt" for line in lines)
    assert system.view("listener").parameters["gain"] in (0.1, 0.2, 0.3)
    refused = run(adapting("AdaptOnStart", ports.replace("ucb1", "ucb7").replace(' adaptation_period="300ms"', "")))
    assert (refused.state, refused.blackboard["o"]) == (MissionState.SUCCEEDED, "rejected")
    assert "ucb7" in refused.blackboard["r"]
