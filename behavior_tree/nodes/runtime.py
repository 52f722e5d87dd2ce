"""The runtime that the nodes of one tree share: time, timers, wake-ups and observers."""

from collections.abc import Callable, Mapping
from typing import Protocol

from ..clock import Clock
from ..status import Status

TransitionHook = Callable[[int, Status, Status, float], None]
"""Called at every change of a stored status with (node uid, previous status, new status, time in seconds)."""


class Debugger(Protocol):
    """Asked about every tick of every node of a tree, once `Tree.debug` has installed it."""

    def before(self, uid: int) -> Status | None:
        """Return SUCCESS or FAILURE to have a node, by its uid, not run and give that; else it runs.

        Asked behind the node's pre-conditions, and not while its stored status is SUCCESS or FAILURE.
        """

    def after(self, uid: int, status: Status) -> Status | None:
        """Return SUCCESS or FAILURE to replace the result of a node, else it stays; asked behind post-conditions."""


class Timers:
    """The pending timers of a tree, at most one for each node."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._deadlines: dict[int, float] = {}

    def start(self, uid: int, duration_s: float) -> float:
        """Start or restart the timer of a node; return its deadline on the tree's clock, in seconds."""
        deadline = self._clock.now() + duration_s
        self._deadlines[uid] = deadline
        return deadline

    def cancel(self, uid: int) -> None:
        """Forget the timer of a node, if it has one."""
        self._deadlines.pop(uid, None)

    def earliest(self) -> float | None:
        """Return the earliest deadline in seconds, or None without pending timers."""
        return min(self._deadlines.values(), default=None)

    def take_due(self) -> bool:
        """Forget the timers whose time has come; return whether there were any."""
        if not self._deadlines:
            return False
        now = self._clock.now()
        due = [uid for uid, deadline in self._deadlines.items() if deadline <= now]
        for uid in due:
            del self._deadlines[uid]
        return bool(due)


class Runtime:
    """The surroundings of a tree's nodes.

    Attributes:
        clock: The source of time.
        timers: The pending timers.
        enums: Names that scripts and Switch nodes may use for whole numbers.
        extensions: Whether scripts may use what BehaviorTree.CPP's cannot; see `compile_script`.
        wake_requested: Whether a node asked for another tick without delay.
        transition_hooks: The observers of status changes.
        debugger: Asked about every tick of a node, None if there is none.
    """

    def __init__(self, clock: Clock, enums: Mapping[str, int], *, extensions: bool = False) -> None:
        self.clock = clock
        self.extensions = extensions
        self.timers = Timers(clock)
        self.enums = enums
        self.wake_requested = False
        self.transition_hooks: list[TransitionHook] = []
        self.debugger: Debugger | None = None

    def take_wake_up(self) -> bool:
        """Return whether a wake-up was raised or a timer came due since the last look."""
        due = self.timers.take_due()
        requested = self.wake_requested
        self.wake_requested = False
        return due or requested

    def announce(self, uid: int, previous: Status, status: Status) -> None:
        """Notify the observers of a node's change of status."""
        now = self.clock.now()
        for hook in self.transition_hooks:
            hook(uid, previous, status, now)
