"""Trees are checked next to a running mission, which they do not hold up."""

from __future__ import annotations

import sys
import threading
from dataclasses import replace
from types import SimpleNamespace
from typing import ClassVar, cast

import pytest

from behavior_tree import Blackboard, NodeSetup, Registry, SyncAction
from regraft import Future, Kit, RefusalCode, RequestRefused
from regraft.bus_schema.messages.mission import Command
from regraft.services.bt_executor import tree_checks
from regraft.services.bt_executor.source import LIMITS, Source
from regraft.services.bt_executor.tree_checks import TreeChecks
from regraft.testing import Rig
from tests.executor.helpers import command, refusal, run, status, tree

WHEREABOUTS = "tests.executor.test_checked_apart:Whereabouts"


class Whereabouts(SyncAction):
    """A leaf that keeps where it was made."""

    threads: ClassVar[list[str]] = []

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self.threads.append(threading.current_thread().name)


def test_a_tree_is_checked_on_another_thread_than_the_mission_runs_on() -> None:
    here = threading.current_thread().name
    with Rig() as rig:
        run(
            rig,
            tree('<Sleep msec="1000000"/>', "<Whereabouts/>"),
            nodes=WHEREABOUTS,
        )
        Whereabouts.threads.clear()
        command(rig, Command.CHECK, tree("<Whereabouts/>"))
        command(rig, Command.SWAP, tree('<Sleep msec="1000000"/>', "<Whereabouts/>"))
        command(rig, Command.PAUSE)
        command(rig, Command.LOAD, tree("<Whereabouts/>"))
        assert [thread == here for thread in Whereabouts.threads] == [False, False, True, True]


@pytest.mark.parametrize("verb", [Command.SWAP, Command.LOAD])
def test_a_tree_that_is_refused_is_never_made_on_the_thread_of_a_running_mission(verb: Command) -> None:
    with Rig() as rig:
        run(rig, tree('<Sleep msec="1000000"/>'), nodes=WHEREABOUTS)
        Whereabouts.threads.clear()
        assert "'late'" in refusal(rig, verb, tree("<Whereabouts/>" * 3, '<Script name="late" code="1 +"/>'))
        assert threading.current_thread().name not in Whereabouts.threads
        assert len(Whereabouts.threads) == 3


def test_a_check_that_takes_too_long_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tree_checks, "CHECK_LIMITS", replace(LIMITS, seconds=0.0))
    with Rig() as rig:
        run(rig, tree('<Sleep msec="1000000"/>'))
        before = status(rig)
        assert "making the tree takes longer than 0 s, up to node 1" in refusal(
            rig, Command.CHECK, tree("<Say text='x'/>")
        )
        assert status(rig) == before
        assert "takes longer than 0 s" in refusal(rig, Command.SWAP, tree("<AlwaysSuccess/>"))
        command(rig, Command.PAUSE)
        command(rig, Command.LOAD, tree("<AlwaysSuccess/>"))


def test_more_checks_at_once_than_the_limit_are_refused() -> None:
    waiting: list[Future[None]] = []

    def compute(*_: object) -> Future[None]:
        waiting.append(Future())
        return waiting[-1]

    checks = TreeChecks(cast("Kit", SimpleNamespace(compute=compute)))
    begun = [checks.check(Source(), Registry(), Blackboard()) for _ in range(tree_checks.MAX_CHECKS + 1)]
    for check_ in begun[:-1]:
        check_.send(None)
    with pytest.raises(RequestRefused, match="4 trees are being checked: check this one later") as refused:
        begun[-1].send(None)
    assert refused.value.code is RefusalCode.BUSY
    waiting[0].resolve(None)
    with pytest.raises(StopIteration):
        begun[0].send(None)
    again = checks.check(Source(), Registry(), Blackboard())
    again.send(None)
    for check_ in (*begun[1:-1], again):
        check_.close()


class Interval(SyncAction):
    """A leaf that keeps how soon the thread that makes it gives way to others, in seconds."""

    seen: ClassVar[list[float]] = []

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self.seen.append(sys.getswitchinterval())


def test_a_check_gives_way_to_the_mission_ten_times_as_soon_as_python_would() -> None:
    usual = sys.getswitchinterval()
    with Rig() as rig:
        run(rig, tree('<Sleep msec="1000000"/>'), nodes="tests.executor.test_checked_apart:Interval")
        command(rig, Command.CHECK, tree("<Interval/>"))
        refusal(rig, Command.CHECK, tree("<Interval/>", '<Script code="1 +"/>'))
        assert [round(usual / seen) for seen in Interval.seen] == [10, 10]
        assert sys.getswitchinterval() == usual
