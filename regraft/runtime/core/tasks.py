"""Drives coroutines over what the kit lets them wait for; no asyncio, no thread, one order of events.

A coroutine awaits a ``Future``. Its task is put back in line when the future is resolved.
"""

from __future__ import annotations

import contextlib
from collections import deque
from collections.abc import Callable, Coroutine
from dataclasses import dataclass, field
from typing import Any

from regraft.component.future import Cancelled, Future

MAX_CLEANUPS = 100
"""Waits at which a coroutine is closed, one after another: its clean-ups may be nested, or never end."""


@dataclass(eq=False, slots=True)
class RunningTask:
    """A running coroutine; ``goal`` is set where it pursues a goal, ``answers`` where it handles one message.

    ``asked_by`` is who asked, by name, where it serves a request. ``cancel_noted`` is a cancelling that came while it
    ran: it takes effect where it awaits next.
    """

    tasks: Tasks
    name: str
    coroutine: Coroutine[Any, Any, Any]
    on_done: Callable[[Any, BaseException | None], None]
    goal: Any = None
    answers: bool = False
    asked_by: str = ""
    waiting_for: Future[Any] | None = None
    cancel_noted: bool = False
    cancelling: bool = False
    finished: bool = False

    def wake(self) -> None:
        """Put the task back in line."""
        self.waiting_for = None
        self.tasks.in_line.append(self)

    def cancel(self) -> None:
        """Raise ``Cancelled`` in the coroutine, at once; what it does about it is its own business.

        One that runs now, as it cancels itself, gets it where it awaits next.
        """
        if self.finished or self.cancelling:
            return
        if self._runs:
            self.cancel_noted = True
            return
        self.cancelling = True
        self.tasks.advance(self)

    @property
    def _runs(self) -> bool:
        """Whether the coroutine, or the generator that serves as one, is being executed."""
        runs = getattr(self.coroutine, "cr_running", False) or getattr(self.coroutine, "gi_running", False)
        return bool(runs)

    def close(self) -> None:
        """End the coroutine wherever it is. Its clean-ups are not waited for, and their exceptions are dropped."""
        for _ in range(MAX_CLEANUPS):
            with contextlib.suppress(Exception, Cancelled):
                self.coroutine.close()
                return


@dataclass(slots=True)
class Tasks:
    """All tasks of one component. ``full`` is of how many handlers and timers no further call may be under way."""

    in_line: deque[RunningTask] = field(default_factory=deque)
    alive: list[RunningTask] = field(default_factory=list)
    current: RunningTask | None = None
    full: int = 0

    def spawn(
        self,
        name: str,
        coroutine: Coroutine[Any, Any, Any],
        on_done: Callable[[Any, BaseException | None], None],
        goal: Any = None,
        *,
        answers: bool = False,
        asked_by: str = "",
    ) -> RunningTask:
        """Start a coroutine; it runs up to its first wait when its turn comes."""
        task = RunningTask(self, name, coroutine, on_done, goal, answers, asked_by)
        self.alive.append(task)
        self.in_line.append(task)
        return task

    def run(self) -> bool:
        """Advance the next task in line; returns whether there was one."""
        if not self.in_line:
            return False
        task = self.in_line.popleft()
        if not task.finished:
            self.advance(task)
        return True

    def advance(self, task: RunningTask) -> None:
        """Run a task up to its next wait or its end."""
        before, self.current = self.current, task
        try:
            if task.cancelling:
                self._abandon_wait(task)
                waiting = task.coroutine.throw(Cancelled())
            else:
                waiting = task.coroutine.send(None)
        except StopIteration as end:
            self._end(task, end.value, None)
        except BaseException as error:
            self._end(task, None, error)
            if isinstance(error, KeyboardInterrupt | SystemExit):
                raise
        else:
            self._wait(task, waiting)
        finally:
            self.current = before

    def _wait(self, task: RunningTask, waiting: object) -> None:
        if task.cancelling:
            task.close()
            self._end(task, None, RuntimeError(f"{task.name} awaited while it was being cancelled"))
        elif not isinstance(waiting, Future):
            task.close()
            self._end(
                task,
                None,
                TypeError(f"{task.name} awaited {waiting!r}; a handler awaits only what self.kit offers"),
            )
        else:
            task.waiting_for = waiting
            waiting.when_done(task.wake)
            if task.cancel_noted:
                task.cancel()

    @staticmethod
    def _abandon_wait(task: RunningTask) -> None:
        if task.waiting_for:
            task.waiting_for.abandon()
            task.waiting_for = None

    def _end(self, task: RunningTask, value: Any, error: BaseException | None) -> None:
        if task.finished:
            return
        task.finished = True
        self.alive.remove(task)
        task.on_done(value, error)

    def cancel_all(self) -> None:
        """Cancel every task, the newest first."""
        for task in reversed(self.alive.copy()):
            task.cancel()
