"""Second runs of components: successors that wait for their turn, and incumbents that are frozen."""

from __future__ import annotations

import time

from regraft.bus_schema.messages.protocol.host import LetSpeak, ProcessState, StartSuccessor
from regraft.host.host_publisher import UnknownComponent
from regraft.host.runs.managed_process import ManagedProcess
from regraft.host.runs.restart_backoff import RestartHistory
from regraft.host.runs.run_history import RunHistory
from regraft.host.runs.starting_checkpoint import StartingCheckpoint
from regraft.runtime.core.assignment import Succession

ALONE_TIMEOUT = 5.0
"""Seconds after which a component that has ended is restarted although another run runs next to it: by then, the
adaptation that started that should have decided which of them continues.
"""


class StandbyRuns:
    """The runs (``processes``, one for each component at the most) next to those that speak for their components.

    The run that speaks may be on another host.
    """

    def __init__(self, speaking: dict[str, ManagedProcess], past: RunHistory) -> None:
        """There are none; ``speaking`` and ``past`` are the host's."""
        self.processes: dict[str, ManagedProcess] = {}
        self._speaking = speaking
        self._past = past
        self._highest: dict[str, int] = {}

    def next_number(self, managed: ManagedProcess) -> int:
        """Return an incarnation that no run of the component has had."""
        name = managed.spec.name
        self._highest[name] = max(self._highest.get(name, 0), managed.incarnation) + 1
        return self._highest[name]

    def leave_out(self, name: str, highest: int) -> None:
        """Give runs of a component that are started from now on higher incarnations than one that others know."""
        self._highest[name] = max(self._highest.get(name, 0), highest)

    def max_incarnation(self, name: str) -> int:
        """Return the highest incarnation that is known of a component, or kept for a run elsewhere."""
        return max(self._highest.get(name, 0), *(managed.incarnation for managed in self._runs(name)), 0)

    def add(self, asked: StartSuccessor) -> ManagedProcess:
        """Return a new successor that is to be started; raises UnknownComponent."""
        name = asked.spec.name
        if asked.incarnation:
            return self._add_alone(asked)
        incumbent = self._incumbent(asked)
        spec = asked.spec.described_as(incumbent.spec)
        history = RestartHistory(spec.restart, total=incumbent.history.total)
        succession = Succession(incumbent.incarnation, asked.with_state)
        last = incumbent.checkpoint
        checkpoint = StartingCheckpoint(last.payload if asked.with_state else b"", last.counts_from)
        self.processes[name] = ManagedProcess(spec, history, succeeds=succession, checkpoint=checkpoint)
        return self.processes[name]

    def _add_alone(self, asked: StartSuccessor) -> ManagedProcess:
        """Return the successor of a run on another host."""
        spec, name = asked.spec, asked.spec.name
        if name in self._speaking or self.has_process(name):
            raise UnknownComponent(f"{name}: there is a run of it on this host already")
        checkpoint = StartingCheckpoint(self._past.checkpoint(name) if asked.with_state else b"")
        # The incumbent answers under the incarnation it was started as, with any present one.
        succession = Succession(asked.incumbent, asked.with_state)
        managed = ManagedProcess(spec, RestartHistory(spec.restart), succeeds=succession, checkpoint=checkpoint)
        managed.incarnation = asked.incarnation - 1
        self.processes[name] = managed
        return managed

    def expect(self, asked: StartSuccessor) -> None:
        """Keep an incarnation for a successor on another host, and leave a run that ends to it; UnknownComponent."""
        incumbent = self._incumbent(asked)
        incumbent.awaited = True
        self.next_number(incumbent)

    def _incumbent(self, asked: StartSuccessor) -> ManagedProcess:
        name = asked.spec.name
        incumbent = self._speaking.get(name)
        if incumbent is None or incumbent.started_as != asked.incumbent or not incumbent.has_process:
            raise UnknownComponent(f"{name}: there is no run {asked.incumbent} of it to succeed")
        if self.has_process(name):
            raise UnknownComponent(f"{name}: it has another run already")
        return incumbent

    def stands(self, managed: ManagedProcess) -> bool:
        """Return whether a run runs next to its component."""
        return self.processes.get(managed.spec.name) is managed

    def has_process(self, name: str) -> bool:
        """Return whether another run runs next to a component."""
        return name in self.processes and self.processes[name].has_process

    def awaits(self, managed: ManagedProcess) -> bool:
        """Return whether another run may continue for a component if this one ends."""
        return managed.awaited or self.has_process(managed.spec.name)

    def forget(self, managed: ManagedProcess) -> None:
        """Know nothing of a run that has ended, but its number and checkpoint if the component is elsewhere now."""
        name = managed.spec.name
        del self.processes[name]
        if name not in self._speaking:
            self._past.note(name, managed.past_until, managed.checkpoint)

    def step_aside(self, name: str) -> None:
        """Have the run that speaks for a component here run next to one on another host."""
        managed = self._speaking.pop(name, None)
        if managed is None:
            return
        managed.restart_by, managed.start_at, managed.awaited = None, None, False
        if managed.has_process:
            self.processes[name] = managed
        else:
            self._past.note(name, managed.past_until, managed.checkpoint)

    def restart_if_alone(self, managed: ManagedProcess, now: float) -> None:
        """Have a component that has ended restarted, if nobody runs next to it any more, or nobody has decided."""
        if managed.restart_by is not None and (now > managed.restart_by or not self.awaits(managed)):
            managed.restart_by, managed.start_at, managed.state = None, now, ProcessState.WAITING

    def _runs(self, name: str) -> list[ManagedProcess]:
        return [processes[name] for processes in (self._speaking, self.processes) if name in processes]

    def run_of(self, name: str, incarnation: int) -> ManagedProcess | None:
        """Return the run of a component that was started as ``incarnation``."""
        return next((managed for managed in self._runs(name) if managed.started_as == incarnation), None)

    def called(self, name: str, incarnation: int) -> ManagedProcess | None:
        """Return the run of a component that speaks as ``incarnation``."""
        return next((managed for managed in self._runs(name) if managed.is_called(incarnation)), None)

    def let_speak(self, asked: LetSpeak) -> None:
        """Have another run speak for a component, or the same as another incarnation; raises UnknownComponent."""
        name = asked.component
        managed = self.run_of(name, asked.started_as)
        if managed is None:
            raise UnknownComponent(f"{name}: there is no run that was started as {asked.started_as}")
        if asked.above is not None:
            managed.rename(max(self.next_number(managed), asked.above + 1))
            self._highest[name] = managed.incarnation
        managed.awaited = False
        if not self.stands(managed):
            return
        former = self._speaking.get(name)
        self._speaking[name] = managed
        del self.processes[name]
        if former is not None:
            former.restart_by = None
            if former.has_process:
                self.processes[name] = former
        if not managed.has_process:
            managed.restart_by = time.monotonic() + ALONE_TIMEOUT
