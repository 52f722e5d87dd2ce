"""Faults on a schedule: between two ticks the source has components fail, and waits for those that come back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from regraft.bus.interface import Answer, BusError
from regraft.bus.known_runs import Run
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.protocol.faults import BringBack, FaultInjected, InjectFault
from regraft.bus_schema.model.hosts.hosts import LOCAL
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.scheduled_faults import FaultKind, ScheduledFault
from regraft.lockstep.scheduled_members import ScheduledMembers
from regraft.patience import Patience
from regraft.runtime.runtime import Runtime

ENDED_TIMEOUT = 60.0
"""Seconds in which the host ends a run, and longer on a busy machine. One that hangs or stops may be silent before for
as long as its `handler_timeout`.
"""
ASK_INTERVAL = 5.0
"""Seconds after which the host is asked again: a question or its answer may be lost."""
BACK_TIMEOUT = 30.0
"""Seconds in which a run that is brought back joins."""


@dataclass(frozen=True, slots=True)
class _Return:
    """A component that is to come back: when (simulated nanoseconds), and later than which run."""

    at: int
    component: str
    above: int
    waits: bool


class FaultSchedule:
    """The faults of one run. While one is carried out, no time passes."""

    def __init__(
        self, runtime: Runtime, members: ScheduledMembers, pump: Callable[[], object], fail: Callable[[str, str], None]
    ) -> None:
        """Call ``pump`` while time is stopped, and ``fail`` with a component whose schedule is not kept, and why."""
        self._runtime = runtime
        self._fail = fail
        self._members = members
        self._pump = pump
        self._faults: list[ScheduledFault] = []
        self._returns: list[_Return] = []
        self._expected: set[Run] = set()

    def begin(self, now: int) -> None:
        """Expect what lies ahead at the simulated time ``now``: a source that was restarted repeats nothing."""
        first = self._runtime.assignment.incarnation == 1
        faults = self._runtime.assignment.faults
        ahead = [fault for fault in faults if first or _nanoseconds(fault.at) > now]
        self._faults = sorted(ahead, key=lambda fault: (fault.at, fault.component))

    def expects(self, run: Run) -> bool:
        """Return whether a run ends now because the schedule wants it."""
        return run in self._expected

    def perform(self, now: int) -> None:
        """Do what is due by ``now``, in the order of its time; a component comes back before others fail."""
        while self._returns or self._faults:
            back, fault = min(self._returns, key=_order, default=None), next(iter(self._faults), None)
            at = None if fault is None else _nanoseconds(fault.at)
            if back is not None and back.at <= now and (at is None or back.at <= at):
                self._returns.remove(back)
                self._bring_back(back)
            elif fault is not None and at is not None and at <= now:
                self._faults.pop(0)
                self._inject(fault)
            else:
                return

    def _inject(self, fault: ScheduledFault) -> None:
        name = fault.component
        member = self._members.lives(name)
        if member is not None:
            self._expected.add((name, member))
        silent = 0.0 if fault.kind is FaultKind.KILL else self._runtime.assignment.hung_after
        done = self._ask("inject", InjectFault(fault, held=True), ENDED_TIMEOUT + silent)
        self._expected.clear()
        if done is None:
            self._fail(name, f"'{fault}' was not confirmed by the host")
        elif not done.certain:
            self._fail(name, f"'{fault}': {done.missed}")
        elif done.missed:
            self._runtime.reporter.event("fault.missed", f"'{fault}': {done.missed}")
        elif fault.kind.ends_the_run:
            self._members.end(done, fault)
            if done.comes_back:
                back = _Return(_nanoseconds(fault.until), name, done.incarnation, member is not None)
                self._returns.append(back)

    def _bring_back(self, back: _Return) -> None:
        done = self._ask("bring_back", BringBack(back.component), ENDED_TIMEOUT)
        if done is None or not (done.comes_back and back.waits):
            return  # somebody has removed it meanwhile, or has started it
        within = Patience(BACK_TIMEOUT)
        while not self._members.has_asked(back.component, back.above):
            if self._runtime.state is State.FINALIZED:
                return
            if within.is_over():
                self._fail(back.component, f"{back.component} has not come back within {BACK_TIMEOUT:g} s")
                return
            self._pump()

    def _ask(self, verb: str, question: object, timeout: float) -> FaultInjected | None:
        """Ask the first host until it answers, with time stopped; None if it has not done it."""
        within = Patience(timeout)
        while not within.is_over() and self._runtime.state is not State.FINALIZED:
            answers = self._asked_once(verb, question)
            if answers:
                return _decoded(answers[0])
        return None

    def _asked_once(self, verb: str, question: object) -> list[Answer]:
        runtime = self._runtime
        answered: list[list[Answer]] = []

        def done(answers: list[Answer]) -> None:
            runtime.post(lambda: answered.append(answers))

        try:
            runtime.bus.ask(runtime.keys.host(LOCAL, verb), codec.encode(question), ASK_INTERVAL, done)
        except BusError:
            self._pump()
            return []
        while not answered and runtime.state is not State.FINALIZED:
            self._pump()
        return answered[0] if answered else []


def _decoded(answer: Answer) -> FaultInjected | None:
    try:
        return None if answer.error else codec.decode(answer.payload, FaultInjected)
    except BadMessage:
        return None


def _order(back: _Return) -> tuple[int, str]:
    return back.at, back.component


def _nanoseconds(seconds: float) -> int:
    return round(seconds * 1e9)
