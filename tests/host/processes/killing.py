"""Adapts a running system again and again while its adaptation manager is killed at random instants."""

from __future__ import annotations

import random
import threading
from collections import Counter
from dataclasses import dataclass, field

from regraft import CallFailed
from regraft.bus_schema.messages.management.manager import ArchitectureRequest, JournalPage, JournalRequest
from regraft.bus_schema.messages.protocol.control import ComponentView
from regraft.bus_schema.model.adaptation import (
    AdaptationReport,
    AdaptationRequest,
    Add,
    Change,
    ChangeState,
    Connect,
    Outcome,
    Remove,
    SetParameters,
    Swap,
)
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.client import ClientError
from tests.support.machine.processes import kill
from tests.support.systems import System
from tests.support.waiting import PATIENCE, wait_until

MANAGER = "adaptation_manager"
STACK = """\
  ticker: {class: 'tests.host.parts:Ticker'}
  twin: {class: 'tests.host.parts:Ticker', connect: {ticks: others}}
  adaptation_manager:
    class: regraft.adaptation_manager.manager:AdaptationManager
    parameters: {journal: $RUN/journal.sqlite, answer_within: 2.0, undo_within: 5.0, start_within: 10.0}
    restart: {limit: 1000, window: 30, backoff: 0.0}
"""
TOPICS = """\
  ticks: {type: host_tests/Tick}
  others: {type: host_tests/Tick}
  spare: {type: host_tests/Tick}
  more: {type: host_tests/Tick}
  adaptations: {type: regraft/AdaptationReport}
  architecture: {type: regraft/Architecture}
"""
EXTRA = ComponentSpec(cls="tests.host.parts:Ticker", connections={"ticks": "more"})
AWAKE = (0.0, 1.0)
"""Seconds that a manager lives, from when its process has been seen to run: between these."""


@dataclass
class Stream:
    """Adaptations one after the other, each asked for until it is applied; ``applied`` are their reports."""

    system: System
    random: random.Random
    applied: list[AdaptationReport] = field(default_factory=list)
    interrupted: int = 0
    problems: list[str] = field(default_factory=list)

    def until(self, over: threading.Event) -> None:
        """Adapt until it is over; then have everything compared once more."""
        while not over.is_set() and not self.problems:
            self._one(len(self.applied) + 1)

    def _one(self, number: int) -> None:
        now = self.architecture()
        changes, confirm = self._changes(now, number)
        attempt = 0
        while True:
            attempt += 1
            key = f"{number}-{attempt}"
            report = self._asked(AdaptationRequest(changes, f"number {number}", key=key, confirm=confirm))
            if report.outcome is Outcome.APPLIED:
                break
            self.interrupted += 1
            if report.outcome is not Outcome.ROLLED_BACK:
                self.problems.append(f"{number}: {report}")
                return
        self.applied.append(report)

    def _asked(self, request: AdaptationRequest) -> AdaptationReport:
        while True:
            try:
                return self.system.client.call(f"{MANAGER}/adapt", request, AdaptationReport, PATIENCE, patient=True)
            except CallFailed as error:
                if error.answer is not None and "only while active" not in error.why:
                    raise

    def _changes(self, now: Architecture, number: int) -> tuple[tuple[Change, ...], float]:
        kind = self.random.choice(["both", "both", "confirmed", "process", "state", "wiring", "swap"])
        step = number % 100 + 1
        both = (SetParameters("ticker", {"step": step}), SetParameters("twin", {"step": step}))
        if kind == "process":
            return (*both, Remove("extra") if "extra" in now.components else Add("extra", EXTRA)), 0.0
        if kind == "state":
            active = now.components["twin"].state is State.ACTIVE
            return (*both, ChangeState("twin", Transition.DEACTIVATE if active else Transition.ACTIVATE)), 0.0
        if kind == "swap":
            return (*both, Swap("twin")), 0.0
        if kind == "wiring":
            topic = "spare" if now.components["ticker"].connections["ticks"] == "ticks" else "ticks"
            return (*both, Connect("ticker", "ticks", topic)), 0.0
        return both, 0.15 if kind == "confirmed" else 0.0

    def architecture(self) -> Architecture:
        """Return what should be, as soon as a manager says it."""
        while True:
            try:
                request = ArchitectureRequest()
                return self.system.client.call(f"{MANAGER}/architecture", request, Architecture, PATIENCE)
            except CallFailed:
                continue

    # --- what must be so at the end ---

    def check(self) -> None:
        """Compare the journal with what was answered, and the running components with the architecture."""
        assert not self.problems, self.problems
        lines = self._journal()
        keys = Counter(line.request.key for line in lines if line.request.key)
        assert set(keys.values()) == {1}, "an adaptation has two lines"
        done = [line for line in lines if line.outcome is Outcome.APPLIED and line.request.key]
        assert [line.request.reason for line in done] == [f"number {n}" for n in range(1, len(self.applied) + 1)]
        assert [line.id for line in done] == [report.id for report in self.applied]
        assert {line.outcome for line in lines} <= {Outcome.APPLIED, Outcome.ROLLED_BACK}
        self._check_revisions(lines)
        now = self.architecture()
        assert now.revision == self.applied[-1].revision_after
        wait_until(lambda: self.system.processes().keys() == now.components.keys(), "the processes to be those wanted")
        for name, spec in now.components.items():
            if name != MANAGER:
                view = self._view(name)
                assert (view.state, view.connections) == (spec.state, spec.connections), name
                assert view.parameters["step"] == spec.parameters.get("step", 1), name

    def _view(self, name: str) -> ComponentView:
        while True:
            try:
                return self.system.client.view(name)
            except ClientError:
                continue

    @staticmethod
    def _check_revisions(lines: list[AdaptationReport]) -> None:
        """One after the other; a gap is what a confirmation was undone in."""
        revision = 1
        withdrawn = 0
        for line in lines:
            if line.outcome is not Outcome.APPLIED:
                withdrawn += bool(line.request.confirm)
            elif line.request.key:
                assert line.revision_before == revision, line
                assert revision < line.revision_after <= revision + 1 + withdrawn, line
                revision, withdrawn = line.revision_after, 0

    def _journal(self) -> list[AdaptationReport]:
        lines: list[AdaptationReport] = []
        while True:
            request = JournalRequest(before=lines[-1].id if lines else "", limit=500)
            page = self.system.client.call(f"{MANAGER}/journal", request, JournalPage, PATIENCE)
            lines += page.entries
            if not page.more:
                return lines[::-1]


def adapt_through_kills(system: System, kills: int, seed: int, awake: tuple[float, float] = AWAKE) -> Stream:
    """Adapt while the manager is killed so often, and check all that must be so afterwards."""
    rng, pause = random.Random(seed), threading.Event()
    stream, over = Stream(system, random.Random(seed + 1)), threading.Event()
    working = threading.Thread(target=stream.until, args=(over,), daemon=True)
    system.wait_running(MANAGER)
    working.start()
    for incarnation in range(1, kills + 1):
        pid = system.wait_running(MANAGER, incarnation).pid
        pause.wait(rng.uniform(*awake))
        kill(pid)
    system.wait_running(MANAGER, kills + 1)
    count = len(stream.applied)
    wait_until(lambda: len(stream.applied) > count + 1 or stream.problems, "the stream to go on")
    over.set()
    working.join(PATIENCE)
    assert not working.is_alive()
    stream.check()
    return stream
