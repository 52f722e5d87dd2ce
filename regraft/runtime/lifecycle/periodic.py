"""The periodic calls of one component: its ``@every`` methods, its checkpoints, its measurements."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import partial

from regraft.runtime.lifecycle.measuring import Measuring
from regraft.runtime.parts import Parts


class PeriodicCalls:
    """The periodic calls of one component."""

    def __init__(self, parts: Parts, checkpoint: Callable[[], None], measuring: Measuring) -> None:
        self._parts = parts
        self._measuring = measuring
        self._checkpoint = checkpoint

    def start(self) -> None:
        """Start all timers, from now."""
        parts = self._parts
        now = parts.clock.now()
        for name, period in parts.declared.timers.items():
            method = getattr(parts.component, name)
            if inspect.iscoroutinefunction(method):
                method = parts.overlapping(name, method, partial(parts.reporter.overrun, f"timer {name!r}"))
            parts.timers.start(name, parts.around(method), period.nanoseconds(parts.parameters.values), now)
        every = type(parts.component).checkpoint_every
        if every is not None:
            parts.timers.start("checkpoint", self._checkpoint, max(1, round(every * 1e9)), now)
        pause = self._measuring.period
        if pause is not None:
            self._measuring.forget()
            # At whole multiples of the period, whenever this run was activated: so equal runs measure alike.
            parts.timers.start("evaluate", self._measuring.publish, pause, now - now % pause)

    def retime(self) -> None:
        """Give timers whose period is a parameter their new period."""
        parts = self._parts
        for name, period in parts.declared.timers.items():
            parts.timers.retime(name, period.nanoseconds(parts.parameters.values), parts.clock.now())
