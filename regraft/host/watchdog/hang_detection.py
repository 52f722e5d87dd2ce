"""Distinguishes hung from slow: a component is hung when its loop is silent although the machine had time for it.

A lease cannot see a Python loop that hangs, so every component's own loop keeps a heartbeat. On a loaded machine a
heartbeat may be late because a thread waits for a processor: one of the component's, of the hub's on its way, or of the
host's own. Such waits (Linux's ``schedstat``) do not count as silence. They are counted from the first closer look on;
those before it are estimated by how crowded the machine is then. Time that was taken from a virtual machine's
processors does not count either: a thread on one then stops without waiting. Nor does a wait that the kernel does not
interrupt (state D): for a slow disk, or for memory that the host of a virtual machine has to bring. It ends by itself,
and a kill does not end it sooner.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field

from regraft.host.watchdog.proc_stats import Look, OpenWaits, Waits
from regraft.patience import crowding

HUNG_TIMEOUT = 0.45
"""Seconds of silence, waits for a processor apart, after which a loop counts as hung unless its class allows more."""
CLOSER_LOOK_TIMEOUT = 0.2
MAX_FORGIVEN = 2.0
"""Seconds of waits for a processor that are forgiven at the most: on a machine so loaded, hung is still found."""
MAX_FORGIVEN_OF_ONE = 30.0
"""The same for the one thread that waited longest: it cannot have done anything meanwhile."""
MAX_FORGIVEN_ON_DISK = 30.0
"""Seconds of uninterruptible waits that are forgiven at the most: in these, too, a thread cannot do anything.

A virtual machine has kept a thread in such a wait for 15 s.
"""


@dataclass(slots=True)
class _Watched:
    pid: int
    allowance: float
    last_beat: float
    waited_at: Waits | None = None
    unseen: float = 0.0
    on_disk: float = 0.0
    told: bool = False
    account: str = ""

    def beats(self, now: float) -> None:
        self.last_beat, self.waited_at, self.unseen, self.on_disk, self.told = now, None, 0.0, 0.0, False


@dataclass(slots=True)
class Watchdog:
    """Watches the heartbeats of many components. Times are monotonic seconds."""

    watched: dict[str, _Watched] = field(default_factory=dict)
    _last_look: float | None = None
    _standing: OpenWaits = field(default_factory=OpenWaits)

    def watch(self, name: str, pid: int, handler_timeout: float, now: float) -> None:
        """Expect heartbeats from now on; silence is allowed for as long as the class's longest handler may take."""
        self.watched[name] = _Watched(pid, max(HUNG_TIMEOUT, handler_timeout), now)

    def forget(self, name: str) -> None:
        """Expect nothing of it any more."""
        self.watched.pop(name, None)

    def beat(self, name: str, now: float) -> None:
        """Take a heartbeat."""
        watched = self.watched.get(name)
        if watched:
            watched.beats(now)

    def hung(self, now: float, hub: str | None) -> list[str]:
        """Return who is hung. While the hub on everybody's way is silent, nobody else can be judged."""
        passed, look = self._since_last_look(now), self._next_look(now)
        silent = [
            name
            for name, watched in self.watched.items()
            if self._silent_for(watched, now, passed, hub, look) > watched.allowance
        ]
        if hub is not None and hub in self.watched and now - self.watched[hub].last_beat > CLOSER_LOOK_TIMEOUT:
            for name, watched in self.watched.items():
                if name != hub:
                    watched.beats(now)
            return [name for name in silent if name == hub]
        return silent

    def _next_look(self, now: float) -> Look:
        if all(now - watched.last_beat < CLOSER_LOOK_TIMEOUT for watched in self.watched.values()):
            self._standing.forget()
        self._standing.now = now
        return Look(self._standing)

    def account(self, name: str) -> str:
        """Report how long somebody is silent, and how much of it the machine is to blame for."""
        return self.watched[name].account if name in self.watched else ""

    def stalled(self) -> list[str]:
        """Return who is silent because it waits for the disk, once for each silence."""
        found = [name for name, watched in self.watched.items() if not watched.told and watched.on_disk > HUNG_TIMEOUT]
        for name in found:
            self.watched[name].told = True
        return found

    def _since_last_look(self, now: float) -> float:
        """Return the seconds since the last look; if the host did not get to look, that is nobody else's silence."""
        passed = 0.0 if self._last_look is None else now - self._last_look
        self._last_look = now
        if passed > CLOSER_LOOK_TIMEOUT:
            for watched in self.watched.values():
                watched.last_beat = min(now, watched.last_beat + passed)
            return 0.0
        return passed

    def _silent_for(self, watched: _Watched, now: float, passed: float, hub: str | None, look: Look) -> float:
        silence = now - watched.last_beat
        if silence < CLOSER_LOOK_TIMEOUT:
            return silence
        on_the_way = {watched.pid, os.getpid()}
        if hub is not None and hub in self.watched:
            on_the_way.add(self.watched[hub].pid)
        waited = {"stolen": look.stolen()}
        for pid in on_the_way:
            waited |= look.processor_wait(pid)
        if watched.waited_at is None:
            watched.waited_at, watched.unseen = waited, silence * (1.0 - 1.0 / crowding())
        if any(look.waits_for_disk(pid) for pid in on_the_way):
            watched.on_disk += passed
        seen = _forgiven(waited, watched.waited_at)
        forgiven = seen + watched.unseen + min(MAX_FORGIVEN_ON_DISK, watched.on_disk)
        watched.account = f"silent for {silence:.2f} s, of which {forgiven:.2f} s were waits of the machine"
        return silence - forgiven


def _forgiven(waited: Waits, before: Waits) -> float:
    """Return the seconds of waits that are forgiven: the longest of one thread, and a little of all the others."""
    passed = sorted(seconds - before.get(thread, 0.0) for thread, seconds in waited.items())
    return min(MAX_FORGIVEN_OF_ONE, passed[-1]) + min(MAX_FORGIVEN, sum(passed[:-1]))
