"""Decorators that depend on the time.

They never wait: while there is nothing to do they return RUNNING, and the tree's `next_wake_up` is when a timer comes
due.
"""

from ..nodes.decorator import Decorator
from ..nodes.durations import read_duration
from ..nodes.node import Node, NodeSetup
from ..nodes.ports import Input
from ..status import COMPLETED, FAILURE, RUNNING, Status


class Delay(Decorator):
    """Waits before it runs the child; waits again after the child completed."""

    delay_msec = Input(int, description="how long to wait, in milliseconds")

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._deadline: float | None = None

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Take the child and check a time that is given as a literal."""
        super().adopt(children)
        if self.has_literal("delay_msec"):
            read_duration(self, "delay_msec")

    def tick(self) -> Status:
        """Start the timer, wait for it, or tick the child."""
        if self._deadline is None:
            self._deadline = self.runtime.timers.start(self.uid, read_duration(self, "delay_msec"))
            self.set_running()
            return RUNNING
        if self.runtime.clock.now() < self._deadline:
            return RUNNING
        status = self.child.execute_tick()
        if status in COMPLETED:
            self._deadline = None
            self.child.reset()
        return status

    def halt(self) -> None:
        """Reset the child and stop the timer."""
        self._deadline = None
        self.runtime.timers.cancel(self.uid)
        super().halt()


class Timeout(Decorator):
    """Halts the child and fails if the child takes too long.

    BehaviorTree.CPP halts the child from another thread at the very moment; here that happens in the next
    tick, which a timer asks for.
    """

    msec = Input(int, description="how long the child may take, in milliseconds; 0: for ever")

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._started = False
        self._deadline: float | None = None

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Take the child and check a time that is given as a literal."""
        super().adopt(children)
        if self.has_literal("msec"):
            read_duration(self, "msec")

    def tick(self) -> Status:
        """Start the timer at first; tick the child unless its time is over."""
        if not self._started:
            self._started = True
            self.set_running()
            duration = read_duration(self, "msec")
            if duration > 0.0:
                self._deadline = self.runtime.timers.start(self.uid, duration)
        if self._deadline is not None and self.runtime.clock.now() >= self._deadline:
            # The timer fires once: a child that is not running then continues without a limit.
            self._deadline = None
            if self.child.status == RUNNING:
                self._stop_timer()
                self.child.reset()
                return FAILURE
        status = self.child.execute_tick()
        if status in COMPLETED:
            self._stop_timer()
            self.child.reset()
        return status

    def halt(self) -> None:
        """Reset the child and stop the timer."""
        self._stop_timer()
        super().halt()

    def _stop_timer(self) -> None:
        self._started = False
        self._deadline = None
        self.runtime.timers.cancel(self.uid)
