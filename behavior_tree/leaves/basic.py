"""Leaves with a fixed result, and the leaf that waits."""

from ..nodes.durations import read_duration
from ..nodes.leaf import StatefulAction, SyncAction
from ..nodes.node import Node, NodeSetup
from ..nodes.ports import Input
from ..status import FAILURE, RUNNING, SUCCESS, Status


class AlwaysSuccess(SyncAction):
    """Succeeds."""

    def tick(self) -> Status:
        """Return SUCCESS."""
        return SUCCESS


class AlwaysFailure(SyncAction):
    """Fails."""

    def tick(self) -> Status:
        """Return FAILURE."""
        return FAILURE


class Sleep(StatefulAction):
    """Runs for a time, then succeeds."""

    msec = Input(int, description="how long, in milliseconds")

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._deadline = 0.0

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Check a time that is given as a literal."""
        super().adopt(children)
        if self.has_literal("msec"):
            read_duration(self, "msec")

    def on_start(self) -> Status:
        """Start the timer."""
        duration = read_duration(self, "msec")
        if duration == 0.0:
            return SUCCESS
        self._deadline = self.runtime.timers.start(self.uid, duration)
        return RUNNING

    def on_running(self) -> Status:
        """Succeed when the time has come."""
        return SUCCESS if self.runtime.clock.now() >= self._deadline else RUNNING

    def on_halted(self) -> None:
        """Stop the timer."""
        self.runtime.timers.cancel(self.uid)
