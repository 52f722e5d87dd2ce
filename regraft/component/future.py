"""A value that will be there later, for one coroutine that awaits it."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Generic, TypeVar

R = TypeVar("R")


class Cancelled(BaseException):
    """Raised in a coroutine, where it awaits, when its task is cancelled. Clean up and let it pass."""


class Future(Generic[R]):
    """A value or an error that will be there later. It has one reader: a coroutine that awaits it, or a callback."""

    def __init__(self) -> None:
        self.done = False
        self.abandoned = False
        self.value: R | None = None
        self.error: BaseException | None = None
        self._callback: Callable[[], None] | None = None

    def __await__(self) -> Generator[Future[R], None, R]:
        """Suspend the awaiting task until this is done."""
        if not self.done:
            yield self
        if self.error is not None:
            raise self.error
        return self.value  # type: ignore[return-value]

    def when_done(self, call: Callable[[], None]) -> None:
        """Call ``call`` once, when this is done. It replaces the previous reader."""
        self._callback, self.abandoned = call, False
        if self.done:
            call()

    def abandon(self) -> None:
        """Remove the reader. The future can still be resolved and looked at."""
        self._callback, self.abandoned = None, True

    def resolve(self, value: R) -> None:
        """Set the value. The first value or error stays."""
        self._finish(value, None)

    def fail(self, error: BaseException) -> None:
        """Set the error. The first value or error stays."""
        self._finish(None, error)

    def _finish(self, value: R | None, error: BaseException | None) -> None:
        if self.done:
            return
        self.value, self.error, self.done = value, error, True  # another thread may look as soon as it is done
        if self._callback:
            self._callback()
