"""The view that leaves have of the component that runs their tree."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from regraft import CallFailed, Future, Goal
from regraft.bus_schema.messages.quality import Quality
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.robots.scoped_changes import Names
from regraft.services.bt_executor.quality.latest_qualities import LatestQualities
from regraft.services.bt_executor.quality.publisher import QualityPublisher

if TYPE_CHECKING:
    from regraft import Kit

A = TypeVar("A")
F = TypeVar("F")


class NoSuchInput(ValueError):
    """An input that the executor does not have; the text names those that it has."""


class Asked(Generic[A]):
    """A request under way, to be looked at in later ticks."""

    def __init__(self, waiting: Future[A], goal: Goal[A, Any] | None, wake: Callable[[], None]) -> None:
        """Have ``wake`` called when the answer comes."""
        self._waiting = waiting
        self._goal = goal
        waiting.when_done(wake)

    @property
    def done(self) -> bool:
        """Whether there is an answer, or will be none."""
        return self._waiting.done

    @property
    def error(self) -> CallFailed | None:
        """Why there is no answer, None if there is one."""
        error = self._waiting.error
        return error if isinstance(error, CallFailed) else None

    @property
    def answer(self) -> A | None:
        """The answer, None before it came."""
        return self._waiting.value

    @property
    def feedback(self) -> Any:
        """A goal's latest feedback, None before the first."""
        return self._goal.feedback if self._goal else None

    def forget(self) -> None:
        """Want no answer any more; a goal continues, unless another one replaces it."""
        self._waiting.abandon()

    def give_up(self) -> None:
        """Want no answer any more; a goal is cancelled."""
        self._waiting.abandon()
        if self._goal:
            self._goal.cancel()


class LeafContext:
    """The executor's kit and inputs, for leaves.

    Attributes:
        kit: The kit of the executor: time, events, diagnostics, log.
        qualities: The latest of the tree's quality requirements.
    """

    def __init__(self, kit: Kit, wake: Callable[[], None]) -> None:
        """Have ``wake`` called when a leaf has something new to look at."""
        self.kit = kit
        self.qualities = LatestQualities()
        self._wake = wake
        self._revision = 0
        self._announcer = QualityPublisher(lambda quality: self.kit.report_quality(quality))

    def call(self, service: str, request: object, reply: type[A], *, timeout: float) -> Asked[A]:
        """Ask a service; the answer, or its absence after ``timeout`` seconds, causes a tick."""
        return Asked(self.kit.call(service, request, reply, timeout=timeout), None, self._wake)

    def goal(
        self, action: str, goal: object, result: type[A], feedback: type[Any] | None, *, accept_within: float
    ) -> Asked[A]:
        """Give an action a goal; its end, or that nobody accepts it in time (s), causes a tick."""
        given = self.kit.goal(action, goal, result, feedback, accept_within=accept_within)
        return Asked(given.outcome(), given, self._wake)

    @property
    def names(self) -> Names:
        """The meaning of the mission's names in the whole system."""
        return Names(self.kit.scope)

    def report_quality(self, quality: Quality) -> None:
        """Take the latest of a quality requirement; it goes out to the bus when it has changed."""
        self.qualities.write(quality)
        self._announcer.tell(quality)

    def know_revision(self, revision: int) -> None:
        """Note the architecture's revision, as the adaptation manager has just answered."""
        self._revision = revision

    def published_architecture(self) -> Architecture | None:
        """Return the architecture by its topic; None if nobody publishes it, or an answer has shown it to be older."""
        published: Architecture | None = self.latest("architecture")
        return published if published is not None and published.revision >= self._revision else None

    def check_input(self, name: str) -> None:
        """Make sure that the executor has an input; raises NoSuchInput."""
        if name not in self.kit.inputs:
            raise NoSuchInput(f"the executor has no input '{name}'; it has: {', '.join(self.kit.inputs)}")

    def latest(self, name: str) -> Any:
        """Return the newest message of one of the executor's inputs, None before the first.

        Raises:
            NoSuchInput: the executor has no such input.
        """
        self.check_input(name)
        return self.kit.inputs[name].latest
