"""Real processes pursue several goals: each outlives swaps, and each client gets an answer when the process dies."""

from __future__ import annotations

import json
from dataclasses import dataclass, field

import pytest

from regraft import CallFailed, RefusalCode
from regraft.bus_schema.messages.protocol.host import ProcessState
from regraft.bus_schema.messages.protocol.requests import Answer
from regraft.bus_schema.model.adaptation import Outcome, Swap
from regraft.client import ClientGoal
from tests.host.adapting.test_swap import adapt
from tests.host.conftest import Start
from tests.host.processes.counting import HERE, Number
from tests.support.commands import run
from tests.support.machine.processes import kill
from tests.support.systems import System
from tests.support.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.slow

HEAD = """\
system: tests
clock: real
imports: [tests.host.processes.counting]
topics:
  adaptations: {type: regraft/AdaptationReport}
  architecture: {type: regraft/Architecture}
components:
"""
STACK = """\
  counter: {class: 'tests.host.processes.counting:Counter'}
  adaptation_manager:
    class: regraft.adaptation_manager.manager:AdaptationManager
    parameters: {journal: $RUN/journal.sqlite, answer_within: 1.0, undo_within: 3.0, start_within: 10.0}
"""
FOR_EVER = 1_000_000


@dataclass
class Counted:
    """A goal, and the numbers that its client has heard."""

    system: System
    to: int
    heard: list[int] = field(default_factory=list)
    goal: ClientGoal[Number, Number] = field(init=False)

    def __post_init__(self) -> None:
        self.goal = self.system.client.goal(
            "count", Number(self.to), Number, Number, on_feedback=lambda number: self.heard.append(number.n)
        )

    def goes_on(self) -> None:
        """Wait until it has come further, or to its end."""
        before = len(self.heard)
        wait_until(lambda: self.goal.done or len(self.heard) > before + 3, f"a goal of {self.to} to be pursued")

    def has_missed_nothing(self) -> bool:
        return self.heard == list(range(1, len(self.heard) + 1))


@pytest.fixture
def counting(start: Start, monkeypatch: pytest.MonkeyPatch) -> System:
    """Return a component that counts, and a manager."""
    monkeypatch.setattr("tests.host.conftest.HEAD", HEAD)
    system = start(STACK)
    for name in ("counter", "adaptation_manager"):
        system.wait_running(name)
    return system


def test_each_goal_goes_on_through_swaps_and_failed_swaps(counting: System) -> None:
    goals = [Counted(counting, to) for to in (FOR_EVER, 150, 100)]
    for cls in ("OtherCounter", "LameCounter", "Counter") * 2:
        for goal in goals:
            goal.goes_on()
        outcome = adapt(counting, Swap("counter", f"{HERE}:{cls}")).outcome
        assert outcome is (Outcome.ROLLED_BACK if cls == "LameCounter" else Outcome.APPLIED)
    assert [goal.goal.result(PATIENCE) for goal in goals[1:]] == [Number(150), Number(100)]
    goals[0].goal.cancel()
    with pytest.raises(CallFailed) as cancelled:
        goals[0].goal.result(PATIENCE)
    assert cancelled.value.answer is Answer.CANCELLED
    wait_until(lambda: len(goals[1].heard) == 150)
    assert all(goal.has_missed_nothing() for goal in goals)


def test_a_manager_that_is_killed_while_it_swaps_harms_no_goal(counting: System) -> None:
    goals = [Counted(counting, FOR_EVER) for _ in range(3)]
    for n in range(3):
        manager = counting.processes()["adaptation_manager"]
        adapt(counting, Swap("counter", f"{HERE}:{('OtherCounter', 'Counter')[n % 2]}"), wait=False)
        kill(manager.pid)
        counting.wait_running("adaptation_manager", manager.incarnation + 1)
        for goal in goals:
            goal.goes_on()
    assert all(goal.has_missed_nothing() and not goal.goal.done for goal in goals)


def test_a_successor_that_pursues_fewer_goals_keeps_the_last(counting: System) -> None:
    goals = [Counted(counting, FOR_EVER) for _ in range(3)]
    for goal in goals:
        goal.goes_on()
    assert adapt(counting, Swap("counter", f"{HERE}:LoneCounter")).outcome is Outcome.APPLIED
    for goal in goals[:2]:
        with pytest.raises(CallFailed, match="replaced by a newer goal") as ended:
            goal.goal.result(PATIENCE)
        assert ended.value.answer is Answer.CANCELLED
    goals[2].goes_on()
    assert goals[2].has_missed_nothing()


def test_each_client_hears_that_the_process_died_and_there_is_room_again(counting: System) -> None:
    goals = [Counted(counting, FOR_EVER) for _ in range(3)]
    for goal in goals:
        goal.goes_on()
    before = counting.processes()["counter"]
    kill(before.pid)
    counting.wait_for("counter", lambda p: p.state is ProcessState.RUNNING and p.pid != before.pid, "restarted")
    for goal in goals:
        with pytest.raises(CallFailed, match="the component was restarted") as ended:
            goal.goal.result(PATIENCE)
        assert ended.value.code is RefusalCode.NOT_FOUND
    assert [Counted(counting, 2).goal.result(PATIENCE) for _ in range(3)] == [Number(2)] * 3


def test_the_command_line_shows_how_many_and_why_not_more(counting: System) -> None:
    (shown,) = json.loads(run("action", "list", "--json").stdout)["actions"]
    assert (shown["name"], shown["goals"]) == ("count", 3)
    assert "goals" in run("action", "list").stdout
    for _ in range(3):
        assert run("action", "send", "count", f"{{n: {FOR_EVER}}}", "--detach").returncode == 0
    refused = run("action", "send", "count", "{n: 1}", "--json")
    assert refused.returncode == 1
    assert json.loads(refused.stderr)["code"] == "busy"
