"""Kills processes that hang, and those that use more than they may."""

from __future__ import annotations

import signal
from collections.abc import Callable, Sequence

from regraft.bus_schema.model.architecture import ComponentSpec, Limits
from regraft.host.host_publisher import HostPublisher
from regraft.host.runs.managed_process import ManagedProcess
from regraft.host.watchdog.hang_detection import Watchdog
from regraft.host.watchdog.memory_use import MemoryUse
from regraft.host.zygote.zygote import Zygote
from regraft.patience import stretched

LOOK_INTERVAL = 0.05
"""Seconds between two looks at what each process does."""
SAY_WHERE_TIMEOUT = 1.0
"""Seconds that a hung process has to write into its log where it hangs, before it is killed by force.

More on a crowded machine, and from when the zygote has sent the signal: a zygote that starts others is late. A process
that does so ends by itself, so nobody waits for these seconds.
"""


class ProcessKiller:
    """Kills processes that hang or use too much, by looks. Times are monotonic seconds."""

    def __init__(self, publisher: HostPublisher, zygote: Zygote) -> None:
        self._silence = Watchdog()
        self._memory = MemoryUse(zygote.pid)
        self._publisher = publisher
        self._zygote = zygote

    def expect(self, managed: ManagedProcess, allowance: float, now: float) -> None:
        """Expect heartbeats of a run from now on; it may be silent for ``allowance`` seconds."""
        self._silence.watch(managed.run, managed.pid, allowance, now)

    def beat(self, managed: ManagedProcess, now: float) -> None:
        """Take a heartbeat."""
        self._silence.beat(managed.run, now)

    def forget(self, managed: ManagedProcess) -> None:
        """Expect nothing of a run any more."""
        self._silence.forget(managed.run)

    def judge(
        self,
        now: float,
        processes: Sequence[ManagedProcess],
        source: ManagedProcess | None,
        limits: Callable[[ComponentSpec], Limits],
    ) -> None:
        """Kill what hangs or uses too much; ``source`` is the time source, which is a hub on everybody's way."""
        hung = set(self._silence.hung(now, source.run if source else None))
        stalled = set(self._silence.stalled())
        for managed in processes:
            if managed.run in hung:
                self._end_hung(managed)
            elif managed.run in stalled:
                name = managed.spec.name
                text = f"{name} gives no sign of life: it waits for a disk or a device, and cannot be interrupted"
                self._publisher.event("component.stalled", name, text, incarnation=managed.incarnation)
        self._judge_memory(now, processes, limits)

    def aborted(self, managed: ManagedProcess, now: float) -> None:
        """Kill a process by force in a while: it has got the signal by which it writes where it is, and ends."""
        if managed.kill_at is None:
            managed.kill_at = now + stretched(SAY_WHERE_TIMEOUT)

    def _end_hung(self, managed: ManagedProcess) -> None:
        name = managed.spec.name
        managed.why_killed = "killed: its loop hung" if managed.seen else "killed: no heartbeat since its start"
        account = self._silence.account(managed.run)
        self._silence.forget(managed.run)
        text = f"{name} gives no sign of life: {managed.why_killed} ({account})"
        self._publisher.event("component.hung", name, text, scheduled=managed.held_until is not None)
        self._zygote.abort(managed.pid)

    def _judge_memory(
        self, now: float, processes: Sequence[ManagedProcess], limits: Callable[[ComponentSpec], Limits]
    ) -> None:
        limited = {managed.run: (managed, limits(managed.spec).memory) for managed in processes if managed.pid}
        allowed = {run: (managed.pid, memory) for run, (managed, memory) in limited.items() if memory is not None}
        for run, used in self._memory.over(now, allowed).items():
            self._end_over_limit(limited[run][0], used, allowed[run][1])

    def _end_over_limit(self, managed: ManagedProcess, used: float, allowed: float) -> None:
        name = managed.spec.name
        if not managed.why_killed and not managed.stopping:
            managed.why_killed = f"it used {used:.1f} MiB of memory and may use {allowed:.1f} MiB, so it was killed"
            text = f"{name} uses {used:.1f} MiB of memory, its limit is {allowed:.1f} MiB: it is killed"
            details = {"incarnation": managed.incarnation, "used": used, "allowed": allowed}
            self._publisher.event("component.over_limit", name, text, **details)
        self._silence.forget(managed.run)
        self._zygote.signal(managed.pid, signal.SIGKILL)
