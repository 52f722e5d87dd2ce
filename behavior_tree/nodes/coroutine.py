"""Actions that are written as one function which takes several ticks."""

from collections.abc import Generator
from typing import Any, TypeAlias

from ..status import FAILURE, RUNNING, SKIPPED, SUCCESS, Status
from .leaf import StatefulAction
from .node import NodeSetup

Steps: TypeAlias = Generator[None, None, Status | None]
"""The generator of `CoroutineAction.run`: it yields while there is something to wait for, and returns the result."""


class CoroutineAction(StatefulAction):
    """An action whose whole course is one function, `run`, without threads or an event loop.

        class Dock(CoroutineAction):
            def run(self) -> Steps:
                self.arm.fold()
                while not self.arm.is_folded:
                    yield                            # RUNNING; go on here at the next tick
                yield from self.wait(0.5)            # seconds of the tree's clock
                return SUCCESS if self.drive_in() else FAILURE

    Halting the action closes the function: a ``finally`` or ``with`` around the ``yield`` cleans up.
    """

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._steps: Steps | None = None

    def run(self) -> Steps:
        """Do the work, yielding until it is done; return the result, None meaning SUCCESS."""
        raise NotImplementedError(f"{type(self).__name__} does not implement run()")

    def wait(self, duration_s: float) -> Generator[None, None, None]:
        """Yield until a time has passed, in seconds of the tree's clock; use it with ``yield from``."""
        deadline = self.runtime.timers.start(self.uid, duration_s)
        while self.runtime.clock.now() < deadline:
            yield

    def on_start(self) -> Status:
        """Begin the function and go to its first ``yield``."""
        steps = self.run()
        if not isinstance(steps, Generator):
            raise TypeError(f"run() of {type(self).__name__} has no yield in it; write a SyncAction instead")
        self._steps = steps
        return self.on_running()

    def on_running(self) -> Status:
        """Continue to the next ``yield``."""
        assert self._steps is not None
        try:
            given = next(self._steps)
        except StopIteration as end:
            self._steps = None
            self.runtime.timers.cancel(self.uid)
            return SUCCESS if end.value is None else _status(end.value)
        if given is not None:
            raise TypeError(f"run() of {type(self).__name__} yields {given!r}; yield nothing, and return the result")
        return RUNNING

    def on_halted(self) -> None:
        """Stop the timer and close the function."""
        self.runtime.timers.cancel(self.uid)
        steps, self._steps = self._steps, None
        if steps is not None:
            steps.close()


def _status(value: Any) -> Status:
    if isinstance(value, bool) or value not in (SUCCESS, FAILURE, SKIPPED):
        raise TypeError(f"run() returned {value!r}; return SUCCESS, FAILURE or SKIPPED")
    return Status(value)
