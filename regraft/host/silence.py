"""Tells the hung from the slow: a component is hung when its loop is silent although it had the processor to itself.

A lease cannot see a Python loop that hangs, so every component's own loop keeps a heartbeat. On a loaded machine a
heartbeat may be late because the process waits for a processor; that wait (Linux's ``schedstat``) does not count.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

HUNG_AFTER = 0.5
"""Seconds of silence, processor waits apart, after which a loop counts as hung, unless its class declares more."""
LOOK_CLOSER_AFTER = 0.25


def processor_wait(pid: int) -> float:
    """Return the seconds that a process's main thread has waited for a processor so far, 0 if unknown."""
    try:
        fields = Path(f"/proc/{pid}/schedstat").read_text().split()
        return int(fields[1]) / 1e9
    except (OSError, IndexError, ValueError):
        return 0.0


@dataclass(slots=True)
class _Watched:
    pid: int
    allowance: float
    last_beat: float
    waited_at: float | None = None


@dataclass(slots=True)
class Silence:
    """Watches the heartbeats of many components. Times are monotonic seconds."""

    watched: dict[str, _Watched] = field(default_factory=dict)
    _last_look: float | None = None

    def watch(self, name: str, pid: int, longest_handler: float, now: float) -> None:
        """Expect heartbeats from now on; silence is allowed for as long as the class's longest handler may take."""
        self.watched[name] = _Watched(pid, max(HUNG_AFTER, longest_handler), now)

    def forget(self, name: str) -> None:
        """Expect nothing of it any more."""
        self.watched.pop(name, None)

    def beat(self, name: str, now: float) -> None:
        """Take a heartbeat."""
        watched = self.watched.get(name)
        if watched:
            watched.last_beat, watched.waited_at = now, None

    def hung(self, now: float, hub: str | None) -> list[str]:
        """Return who is hung. While the hub on everybody's way is silent, nobody else can be judged."""
        self._forgive_own_absence(now)
        silent = [name for name, watched in self.watched.items() if self._silent_for(watched, now) > watched.allowance]
        if hub is not None and hub in self.watched and self._is_suspect(self.watched[hub], now):
            for name, watched in self.watched.items():
                if name != hub:
                    watched.last_beat, watched.waited_at = now, None
            return [name for name in silent if name == hub]
        return silent

    def _forgive_own_absence(self, now: float) -> None:
        """If the host itself did not get to look, that is nobody else's silence."""
        if self._last_look is not None and now - self._last_look > LOOK_CLOSER_AFTER:
            absent = now - self._last_look
            for watched in self.watched.values():
                watched.last_beat += absent
        self._last_look = now

    @staticmethod
    def _is_suspect(watched: _Watched, now: float) -> bool:
        return now - watched.last_beat > LOOK_CLOSER_AFTER

    @staticmethod
    def _silent_for(watched: _Watched, now: float) -> float:
        silence = now - watched.last_beat
        if silence < LOOK_CLOSER_AFTER:
            return silence
        waited = processor_wait(watched.pid)
        if watched.waited_at is None:
            watched.waited_at = waited
        return silence - (waited - watched.waited_at)
