"""When a component's process is started again, and when it is left alone."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

from regraft.bus_schema.model.architecture import Restart, RestartPolicy

MAX_BACKOFF = 10.0
"""Seconds to which waiting doubles; a policy that begins with more keeps to that."""


@dataclass(slots=True)
class RestartHistory:
    """The recent restarts of one component. Times are monotonic seconds, those in ``simulated`` are of that time."""

    policy: RestartPolicy
    recent: deque[float] = field(default_factory=deque)
    simulated: deque[float] = field(default_factory=deque)
    total: int = 0

    def wants_restart(self, code: int) -> bool:
        """Return whether a process that ended with ``code`` is to be started again at all."""
        if self.policy.when is Restart.NEVER:
            return False
        return self.policy.when is Restart.ALWAYS or code != 0

    def next_start(self, now: float) -> float | None:
        """Return when to start again, None if it was restarted too often: it is quarantined."""
        while self.recent and now - self.recent[0] > self.policy.window:
            self.recent.popleft()
        if len(self.recent) >= self.policy.limit:
            return None
        longest = max(MAX_BACKOFF, self.policy.backoff)
        wait: float = min(longest, self.policy.backoff * 2.0 ** len(self.recent))
        self.recent.append(now)
        self.total += 1
        return now + wait

    def allows_at(self, moment: float) -> bool:
        """Note a restart after a scheduled end at a simulated time; return whether it is allowed, or too many.

        The clock on the wall does not count: in every run of the schedule the same restart is one too many.
        """
        while self.simulated and moment - self.simulated[0] > self.policy.window:
            self.simulated.popleft()
        if len(self.simulated) >= self.policy.limit:
            return False
        self.simulated.append(moment)
        self.total += 1
        return True

    def pardon(self) -> None:
        """Forget the recent restarts: someone has acted."""
        self.recent.clear()
        self.simulated.clear()
