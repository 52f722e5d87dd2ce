"""When to adapt: one decorator for each moment in the life of the child."""

from __future__ import annotations

from typing import Any, ClassVar, Final

from behavior_tree import FAILURE, RUNNING, SUCCESS, Input, Node, Status
from regraft.services.bt_executor.adaptation.decorator import AdaptDecorator
from regraft.services.bt_executor.adaptation.dialogue import AttemptSteps
from regraft.services.bt_executor.adaptation.port_values.durations import AT_ONCE
from regraft.services.bt_executor.adaptation.port_values.ports import duration_of, is_known
from regraft.services.bt_executor.adaptation.port_values.terms import BAD_VALUES
from regraft.services.bt_executor.adaptation.results import UNCHANGED, Result

MIN_PERIOD: Final = 0.01
"""Seconds; the adaptation manager could not follow what is asked for more often."""


class AdaptOnStart(AdaptDecorator):
    """Adapts before the child starts, which it does when the adaptation is complete."""

    def on_started(self) -> None:
        """Adapt."""
        self.under_way.begin()

    def holds_child_back(self) -> bool:
        """Let the child wait as long as an answer is outstanding."""
        return self.under_way.busy


class AdaptOnRunning(AdaptDecorator):
    """Adapts while the child is running, as often as there is something to adapt; one adaptation at a time.

    After one that came to nothing it pauses for ``retry_after``; with a strategy, after any choice for ``settle``.
    """

    def on_child_ticked(self, status: Status) -> None:
        """Adapt if the child is running, nothing is under way, and it is time."""
        if status == RUNNING and not self.under_way.busy and self.is_time():
            self.on_time()
            self.under_way.begin()

    def is_time(self) -> bool:
        """Return whether to look now for something to adapt."""
        return self.now() >= self.under_way.rests_until - AT_ONCE

    def on_time(self) -> None:
        """Note that it is being looked for."""

    def tell(self, result: Result) -> None:
        """Report how an adaptation ended; that there was nothing to change is no news while the child is running."""
        if result.outcome != UNCHANGED:
            super().tell(result)


class AdaptPeriodically(AdaptOnRunning):
    """Adapts at fixed intervals while the child is running; the first of them begins when the child starts.

    A time that comes while an answer is outstanding is made up for as soon as it is there.
    """

    adaptation_period = Input[Any](description="the interval: seconds, or with a unit as in 200ms, 3s, 2min")

    _last: float = 0.0

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Check the ports; see `Node.adopt`."""
        super().adopt(children)
        if "adaptation_period" not in self.setup.readers:
            raise ValueError(f"{self.type_id} needs the port adaptation_period")
        if is_known(self, "adaptation_period"):
            self._period()

    def on_started(self) -> None:
        """Begin the first interval."""
        self._last = self.now()

    def is_time(self) -> bool:
        """Return whether an interval has passed."""
        period = self._readable_period()
        if period is None:
            return super().is_time()
        return self.now() >= self._last + period - AT_ONCE

    def on_time(self) -> None:
        """Begin the next interval where this one should have ended, unless that is long over."""
        period = self._readable_period()
        if period is None:
            return
        due = self._last + period
        self._last = due if self.now() < due + period else self.now()

    def next_time(self) -> float | None:
        """Return when the interval ends, or when to try again."""
        if self.under_way.busy:
            return super().next_time()
        period = self._readable_period()
        return self.under_way.rests_until if period is None else self._last + period

    def attempt(self) -> AttemptSteps:
        """Decide, and have it carried out, if the interval makes sense."""
        self._period()
        return (yield from super().attempt())

    def _readable_period(self) -> float | None:
        """Return the interval, None while its port makes no sense: the next attempt is rejected for that."""
        try:
            return self._period()
        except BAD_VALUES:
            return None

    def _period(self) -> float:
        period = duration_of(self, "adaptation_period")
        if period < MIN_PERIOD:
            raise ValueError(f"port 'adaptation_period' is {period:g} s; it must be at least {MIN_PERIOD:g} s")
        return period


class _AdaptOnResult(AdaptDecorator):
    """Adapts when the child has completed, then returns what the child returned.

    Attributes:
        results: The child's results that count.
    """

    results: ClassVar[tuple[Status, ...]]

    def on_child_ticked(self, status: Status) -> None:
        """Adapt on one of the results."""
        if status in self.results:
            self.under_way.begin()


class AdaptOnSuccess(_AdaptOnResult):
    """Adapts when the child has succeeded; succeeds when the adaptation has ended."""

    results = (SUCCESS,)


class AdaptOnFailure(_AdaptOnResult):
    """Adapts when the child has failed; fails when the adaptation has ended."""

    results = (FAILURE,)


class AdaptOnAnyStatus(_AdaptOnResult):
    """Adapts when the child has completed, however; returns its result when the adaptation has ended."""

    results = (SUCCESS, FAILURE)


RESTARTING: Final = (AdaptOnStart, _AdaptOnResult)
"""Those that adapt each time the child starts or completes."""

ADAPT_DECORATORS: Final[tuple[type[AdaptDecorator], ...]] = (
    AdaptOnAnyStatus,
    AdaptOnFailure,
    AdaptOnRunning,
    AdaptOnStart,
    AdaptOnSuccess,
    AdaptPeriodically,
)
