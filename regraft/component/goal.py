"""A goal that an action pursues for this component."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

from regraft.component.errors import CallFailed
from regraft.component.future import Future

A = TypeVar("A")
F = TypeVar("F")


class Goal(Generic[A, F]):
    """A goal under way: its feedback, its outcome, and how to cancel it.

    Attributes:
        feedback: the latest feedback, None before the first.
    """

    def __init__(self, outcome: Future[A], accepted: Future[None], cancel: Callable[[], None]) -> None:
        self.feedback: F | None = None
        self._outcome = outcome
        self._accepted = accepted
        self._cancel = cancel

    @property
    def done(self) -> bool:
        """Whether it has ended, successfully or not."""
        return self._outcome.done

    @property
    def accepted(self) -> bool:
        """Whether the action has accepted it."""
        return self._accepted.done

    @property
    def error(self) -> CallFailed | None:
        """The reason of the failure, None while it runs and after a success."""
        error = self._outcome.error
        return error if isinstance(error, CallFailed) else None

    @property
    def result(self) -> A | None:
        """The result, None before the end and after a failure."""
        return self._outcome.value

    def outcome(self) -> Future[A]:
        """Return the future of the result: ``await goal.outcome()``; raises CallFailed."""
        return self._outcome

    def cancel(self) -> None:
        """Ask the action to end it."""
        self._cancel()
