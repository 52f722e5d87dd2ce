"""A component continues from its own checkpoint, not from that of a run that was undone."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import pytest

from regraft.bus.memory_bus import MemoryBus, MemoryHub
from regraft.bus.zenoh_bus import open_bus
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.health import ComponentStatus
from regraft.bus_schema.messages.protocol.control import Snapshot
from regraft.bus_schema.messages.protocol.host import (
    LetSpeak,
    ProcessState,
    StartComponent,
    StartSuccessor,
    StopComponent,
    UpdateSpecs,
)
from regraft.bus_schema.model.adaptation import Outcome, Swap
from regraft.bus_schema.model.architecture import Restart, RestartPolicy
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.watched import Condition
from regraft.host.host import Host
from regraft.runtime.core.clock import RealClock
from regraft.runtime.data.writers import Identity, Writers
from tests.host.adapting.test_swap import adapt
from tests.host.conftest import HEAD, Start
from tests.host.processes.test_records_of_runs import HOME, NoProcesses, ask, ended, plan, started
from tests.support.machine.processes import kill
from tests.support.systems import System
from tests.support.waiting import wait_until

TICKER = replace(HOME, restart=RestartPolicy(Restart.NEVER))
LEAPER = replace(TICKER, cls="tests.host.parts:Leaper")
TRIAL = UpdateSpecs(2, (LEAPER,), term=1, on_trial=("ticker",))
UNDONE = UpdateSpecs(1, (TICKER,), term=1, undoes=2)
START = StartComponent("ticker", term=1)
STOP = StopComponent("ticker", 0.0, 1)
VERBS = {
    UpdateSpecs: "specs",
    StartComponent: "start",
    StopComponent: "stop",
    StartSuccessor: "succeed",
    LetSpeak: "speak",
}


class NotedStates(NoProcesses):
    """Starts nothing, and notes the states from which processes are to continue."""

    def __init__(self) -> None:
        super().__init__()
        self.states: list[Any] = []

    def spawn(
        self, assignment: Mapping[str, Any], folder: str, log: str, command: list[str] | None, files: int | None = None
    ) -> None:
        super().spawn(assignment, folder, log, command, files)
        checkpoint = assignment["checkpoint"]
        self.states.append(checkpoint["state"] if checkpoint else None)

    def reports(self, take: Callable[[dict[str, Any]], object]) -> None:
        threading.Event().wait()


class Place:
    """A host on a bus, on which the test puts what the component's runs put."""

    def __init__(self, name: str = "local") -> None:
        self.hub = MemoryHub()
        self.zygote = NotedStates()
        self.host = Host(plan(name, TICKER), MemoryBus(self.hub), self.zygote)
        self.host.start()

    def ask(self, *questions: object) -> None:
        for question in questions:
            ask(self.host, VERBS[type(question)], question)
            self.host.pump(0.0)

    def keeps(self, incarnation: int, state: str) -> None:
        """Have a run of the component put a checkpoint."""
        key = Keys("tests").checkpoint("ticker")
        self._put(key, Snapshot("ticker", incarnation, 0.0, 1, state), Identity("ticker", incarnation, incarnation))

    def stands_by(self, incarnation: int) -> None:
        """Have a successor of the component put its first status."""
        status = ComponentStatus("ticker", incarnation, State.UNCONFIGURED, 1, 0.0)
        self._put(Keys("tests").standby("ticker"), status, Identity("ticker+", incarnation, incarnation))

    def _put(self, key: str, message: object, identity: Identity) -> None:
        writers = Writers(MemoryBus(self.hub), RealClock(), identity)
        writers.open(key, type_of(type(message)).encoding).put(codec.encode(message))

    def run_ends(self, incarnation: int, *states: str) -> None:
        """Have a run come up, put checkpoints, and end."""
        started(self.host, "ticker", incarnation)
        for state in states:
            self.keeps(incarnation, state)
        self.host.pump(0.0)
        ended(self.host, "ticker", incarnation)


@pytest.fixture
def local() -> Place:
    """Return the host of a component that has ended, and whose last checkpoint is its own."""
    place = Place()
    place.host.pump(0.0)
    place.run_ends(1, "its own")
    return place


def test_a_component_whose_replacement_was_undone_continues_from_its_own_checkpoint(local: Place) -> None:
    local.ask(TRIAL, START)
    started(local.host, "ticker", 2)
    local.keeps(2, "of the trial")
    local.ask(UNDONE)
    local.keeps(2, "after that")
    local.ask(STOP)
    ended(local.host, "ticker", 2)
    local.keeps(2, "late")
    local.ask(START)
    assert local.zygote.states == [None, "its own", "its own"]
    local.run_ends(3, "anew")
    local.ask(START)
    assert local.zygote.states[-1] == "anew"


def test_a_component_that_had_kept_nothing_begins_afresh_after_an_undone_replacement() -> None:
    local = Place()
    local.host.pump(0.0)
    local.run_ends(1)
    local.ask(TRIAL, START)
    local.run_ends(2, "of the trial")
    local.ask(UNDONE, START)
    assert local.zygote.states == [None, None, None]


def test_a_replacement_that_starts_afresh_leaves_the_checkpoint_to_whom_it_replaces(local: Place) -> None:
    local.ask(TRIAL, replace(START, afresh=True))
    local.run_ends(2)
    local.ask(UNDONE, START)
    assert local.zygote.states == [None, None, "its own"]


def test_a_replacement_that_was_applied_continues_from_its_own_checkpoint(local: Place) -> None:
    local.ask(TRIAL, START, replace(TRIAL, on_trial=()))
    local.run_ends(2, "of the trial")
    local.ask(UpdateSpecs(3, term=1), replace(UNDONE, undoes=3), UNDONE, START)
    assert local.zygote.states == [None, "its own", "of the trial"]


def test_an_undo_that_is_repeated_leaves_what_was_kept_since(local: Place) -> None:
    local.ask(TRIAL, START)
    local.run_ends(2, "of the trial")
    local.ask(UNDONE, START)
    local.run_ends(3, "anew")
    local.ask(UNDONE, START)
    assert local.zygote.states[-1] == "anew"


def test_an_addition_that_was_undone_leaves_the_checkpoint_of_who_was_removed(local: Place) -> None:
    local.ask(UpdateSpecs(1, removed=("ticker",), term=1), STOP)
    assert "ticker" not in local.host.processes
    local.ask(TRIAL, replace(START, resume=True))
    started(local.host, "ticker", 2)
    local.keeps(2, "of the trial")
    local.ask(UpdateSpecs(1, removed=("ticker",), term=1, undoes=2), STOP)
    ended(local.host, "ticker", 2)
    local.keeps(2, "late")
    local.ask(UpdateSpecs(3, (TICKER,), term=1), replace(START, resume=True))
    assert local.zygote.states == [None, "its own", "its own"]


def test_another_host_continues_from_the_checkpoint_of_before_an_undone_replacement() -> None:
    edge = Place("edge")
    edge.keeps(1, "its own")
    edge.ask(replace(TRIAL, specs=()))
    edge.keeps(2, "of the trial")
    edge.ask(replace(UNDONE, specs=()))
    edge.keeps(2, "late")
    edge.ask(UpdateSpecs(3, (replace(TICKER, host="edge"),), term=1), replace(START, resume=True))
    assert edge.zygote.states == ["its own"]


def test_a_host_that_had_a_component_on_trial_keeps_its_own_checkpoint_of_it() -> None:
    edge = Place("edge")
    edge.keeps(1, "its own")
    edge.ask(replace(TRIAL, specs=(replace(LEAPER, host="edge"),)), replace(START, resume=True))
    edge.run_ends(2, "of the trial")
    edge.ask(UNDONE)
    edge.keeps(2, "late")
    edge.ask(UpdateSpecs(3, (replace(TICKER, host="edge"),), term=1), replace(START, resume=True))
    assert edge.zygote.states == ["its own", "its own"]


def test_another_host_continues_from_a_checkpoint_after_a_swap_that_failed() -> None:
    edge = Place("edge")
    edge.keeps(1, "its own")
    edge.stands_by(2)
    edge.keeps(1, "later")
    edge.ask(UpdateSpecs(2, (replace(TICKER, host="edge"),), term=1), replace(START, resume=True))
    assert edge.zygote.states == ["later"]
    assert edge.zygote.orders == [("ticker", 3)]


def test_another_host_continues_from_a_checkpoint_after_a_move_to_it_that_failed() -> None:
    edge = Place("edge")
    edge.keeps(1, "its own")
    edge.ask(StartSuccessor(replace(TICKER, host="edge"), 1, True, 1, 2))
    started(edge.host, "ticker", 2)
    edge.keeps(1, "meanwhile")
    edge.ask(StopComponent("ticker", 0.0, 1, started_as=2))
    ended(edge.host, "ticker", 2)
    edge.keeps(1, "later")
    edge.ask(UpdateSpecs(2, (replace(TICKER, host="edge"),), term=1), replace(START, resume=True))
    assert edge.zygote.states == ["its own", "later"]
    assert edge.zygote.orders[-1] == ("ticker", 3)


def test_another_host_leaves_out_a_run_after_which_no_further_one_can_be_numbered() -> None:
    edge = Place("edge")
    edge.keeps(1, "its own")
    edge.stands_by(2**32 - 1)
    edge.keeps(2**32 - 1, "forged")
    edge.ask(UpdateSpecs(2, (replace(TICKER, host="edge"),), term=1), replace(START, resume=True))
    assert edge.zygote.states == ["its own"]
    assert edge.zygote.orders == [("ticker", 2)]


def test_a_host_keeps_checkpoints_of_a_moved_component_while_the_former_run_still_stands() -> None:
    local = Place()
    local.host.pump(0.0)
    started(local.host, "ticker", 1)
    local.keeps(1, "before the move")
    away = replace(TICKER, host="edge")
    local.ask(StartSuccessor(away, 1, True, 1), LetSpeak("ticker", 2, None, 1, "edge"), UpdateSpecs(2, (away,), term=1))
    local.keeps(2, "after the move")
    local.host.take_lazy()
    local.ask(replace(STOP, started_as=1))
    ended(local.host, "ticker", 1)
    local.ask(UpdateSpecs(3, (TICKER,), term=1), replace(START, resume=True))
    assert local.zygote.states == [None, "after the move"]


STACK = """\
  ticker: {class: 'tests.host.parts:Ticker', parameters: {step: 100}, restart: {when: never}}
  adaptation_manager:
    class: regraft.adaptation_manager.manager:AdaptationManager
    parameters: {journal: $RUN/journal.sqlite}
"""
TOPICS = "  adaptations: {type: regraft/AdaptationReport}\n  architecture: {type: regraft/Architecture}\ncomponents:\n"


def _begun(system: System) -> list[int]:
    """Return the counts that runs of the ticker began with."""
    lines = [line.split() for line in system.client.logs("ticker")]
    return [int(line[-1]) for line in lines if line[:2] == ["ticker", "begins"]]


def _wait_for_checkpoints(system: System) -> None:
    bus, kept = open_bus(system.info.hub), list[object]()
    try:
        bus.subscribe(system.client.keys.checkpoint("ticker"), kept.append)
        wait_until(lambda: len(kept) > 2, "checkpoints")
    finally:
        bus.close()


@pytest.mark.slow
def test_a_process_that_replaces_a_component_again_continues_from_its_checkpoint(
    start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tests.host.conftest.HEAD", HEAD.replace("components:\n", TOPICS))
    system = start(STACK)
    run = system.wait_for("ticker", lambda p: p.state is ProcessState.RUNNING, "up")
    _wait_for_checkpoints(system)
    kill(run.pid)
    system.wait_for("ticker", lambda p: p.state is ProcessState.STOPPED, "ended")
    watch = (Condition(require="ticker.step > 5"),)
    swap = Swap("ticker", "tests.host.parts:Leaper", {"step": 1}, with_state=False)
    assert adapt(system, swap, confirm=1.0, watch=watch).outcome is Outcome.ROLLED_BACK
    assert adapt(system, Swap("ticker", "tests.host.parts:Leaper")).outcome is Outcome.APPLIED
    wait_until(lambda: len(_begun(system)) == 3, "three runs")
    first, of_the_trial, last = _begun(system)
    assert (first, of_the_trial) == (0, 0)
    assert last >= 100
    assert last % 100 == 0
