"""Measures and publishes a component's qualities, next to its work and to simulated time."""

from __future__ import annotations

from regraft.bus_schema.messages.health import Level
from regraft.bus_schema.messages.management.qualities import MeasuredQualities
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.qualities.qualities import Judged, all_unknown, judged, measured
from regraft.bus_schema.texts import told
from regraft.component.quality import PartlyMeasured
from regraft.runtime.parts import Parts

FAULT_AFTER = 5
"""Measurements in a row without any usable value that make a fault."""
SUBJECT = "qualities"
REPEAT_INTERVAL = 5.0
"""Seconds of the component's clock before a problem of the same quality is an event again."""


class Measuring:
    """The measured qualities of one component."""

    def __init__(self, parts: Parts) -> None:
        self._parts = parts
        self._described = measured(quality.describe() for quality in parts.declared.qualities.values())
        self._reported: dict[str, str] = {}
        self._told_at: dict[str, float] = {}
        self._failures = 0
        self._last: MeasuredQualities | None = None

    @property
    def period(self) -> int | None:
        """Nanoseconds between two measurements, None if there are none."""
        every = type(self._parts.component).evaluate_every
        return max(1, round(every * 1e9)) if every is not None and self._described else None

    def publish(self) -> None:
        """Measure and publish; the component continues even if an author's ``evaluate`` raises."""
        found = self.measure()
        self._last = self._message(found)
        self._parts.reporter.measured(self._last)
        self._report(found)

    def measure(self) -> Judged:
        """Return what ``evaluate`` gives now."""
        try:
            return judged(self._described, self._parts.component.evaluate())
        except PartlyMeasured as partly:
            failed = {name: _raised(error) for name, error in partly.errors.items()}
            return judged(self._described, partly.values, failed)
        except Exception as error:
            return all_unknown(self._described, _raised(error))

    def last(self) -> MeasuredQualities:
        """Return what was published last in this state, for a tool that has just come."""
        state = self._parts.state
        if state is not State.ACTIVE:
            return self._message(all_unknown(self._described, f"the component is {state.value}"))
        return self._last or self._message(all_unknown(self._described, "not measured yet"))

    def forget(self) -> None:
        """Forget what was measured: the component has just become active."""
        self._last = None
        self._parts.reporter.forget_measured()

    def invalidate(self, why: str) -> None:
        """Publish that what was measured no longer counts: it belongs to how the component was configured then."""
        if self._last is not None and self._parts.state is State.ACTIVE:
            self._last = self._message(all_unknown(self._described, why))
            self._parts.reporter.measured(self._last)

    def _message(self, found: Judged) -> MeasuredQualities:
        assignment, period = self._parts.assignment, self.period
        return MeasuredQualities(
            self._parts.clock.now() / 1e9,
            assignment.name,
            assignment.incarnation,
            0.0 if period is None else period / 1e9,
            found.values,
            found.unknown,
        )

    def _report(self, found: Judged) -> None:
        """Report each problem once, until it is over; a component without any usable value has a fault."""
        reporter, problems = self._parts.reporter, found.problems
        fresh: dict[str, list[str]] = {}
        now = self._parts.clock.now() / 1e9
        for name in problems.keys() - self._reported.keys():
            if now - self._told_at.get(name, -REPEAT_INTERVAL) < REPEAT_INTERVAL:
                continue
            self._told_at[name] = now
            fresh.setdefault(problems[name], []).append(name)
        for why, names in fresh.items():
            reporter.event("quality.unknown", _sentence(sorted(names), why), qualities=sorted(names), why=why)
        if problems.keys() != self._reported.keys():
            level = Level.WARNING if problems else Level.OK
            text = f"unknown: {', '.join(sorted(problems))}" if problems else "all that is given counts"
            reporter.diagnose(SUBJECT, level, text, problems=problems)
        self._reported = problems
        self._told_at = {name: at for name, at in self._told_at.items() if now - at < REPEAT_INTERVAL}
        self._failures = self._failures + 1 if problems and not found.values else 0
        if self._failures == FAULT_AFTER:
            text = f"no quality is known after {FAULT_AFTER} measurements: {next(iter(problems.values()))}"
            reporter.event("quality.fault", text)
            reporter.diagnose(SUBJECT, Level.ERROR, text, problems=problems)


def _raised(error: Exception) -> str:
    return f"evaluate raised {told(error)}"[:500]


def _sentence(names: list[str], why: str) -> str:
    subject = "the quality" if len(names) == 1 else "the qualities"
    return f"{subject} {', '.join(map(repr, names))} {'is' if len(names) == 1 else 'are'} unknown: {why}"
