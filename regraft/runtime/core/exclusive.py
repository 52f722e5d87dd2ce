"""Exclusive slots: pauses between rounds of simulated time, granted to one component at a time."""

from __future__ import annotations

from types import TracebackType

from regraft.component.future import Future
from regraft.runtime.core.tasks import RunningTask, Tasks


class WaitsForEver(RuntimeError):
    """The holder of an exclusive slot waits for what cannot happen in it."""

    def __init__(self) -> None:
        super().__init__("waits for time, a message or a call while it holds the slot; in a slot, only ask and compute")


class Slots:
    """The slot of a component's tasks: which of them wait, which holds it. Under the real clock it is always granted.

    ``asking`` counts the questions to the bus that are under way.
    """

    def __init__(self, *, stepped: bool) -> None:
        self.granted = not stepped
        self.holders: list[RunningTask] = []
        self.asking = 0
        self.touched: set[str] = set()
        self._waiters: list[Future[None]] = []

    @property
    def wanted(self) -> bool:
        """Whether somebody waits for the slot."""
        return bool(self._waiters) and any(not waiting.abandoned for waiting in self._waiters)

    def enter(self) -> Future[None]:
        """Return what the slot resolves."""
        waiting: Future[None] = Future()
        if self.granted:
            waiting.resolve(None)
        else:
            self._waiters.append(waiting)
        return waiting

    def grant(self) -> None:
        """Give the slot to all who wait for it; the component's own thread keeps them apart."""
        self.granted = True
        waiters, self._waiters = self._waiters, []
        for waiting in waiters:
            waiting.resolve(None)

    def free(self) -> bool:
        """Cancel the holders if nothing can wake them any more; returns whether that was so.

        To be called when all work is done. In a slot no time passes and no message comes, so only answers from the bus
        are waited for.
        """
        if not self.holders or self.asking > 0:
            return False
        for task in self.holders.copy():
            task.cancel()
        return True

    def withdraw(self) -> tuple[str, ...]:
        """End the slot; returns the components that were touched in it."""
        self.granted = False
        touched = tuple(sorted(self.touched))
        self.touched.clear()
        return touched


class Exclusive:
    """``async with kit.exclusive() as slot``: hold the slot; report to it which components you touch."""

    def __init__(self, slots: Slots, tasks: Tasks) -> None:
        self._slots = slots
        self._tasks = tasks
        self._holder: RunningTask | None = None

    async def __aenter__(self) -> Exclusive:
        """Wait for the slot."""
        await self._slots.enter()
        self._holder = self._tasks.current
        assert self._holder is not None, "only a task can await"
        self._slots.holders.append(self._holder)
        return self

    def touch(self, component: str) -> None:
        """Note a component whose wiring or timing may change."""
        self._slots.touched.add(component)

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Give the slot back."""
        assert self._holder is not None
        self._slots.holders.remove(self._holder)
