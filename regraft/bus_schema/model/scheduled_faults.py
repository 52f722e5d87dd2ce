"""Faults on a schedule: what is to go wrong with which component, and when."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Annotated

from regraft.bus_schema.annotations import Bounds, Unit
from regraft.bus_schema.encoding.registry import message

LONGEST = 1e6
"""Seconds of the system's time that a schedule may speak of: eleven days."""
USUAL_DELAY = 0.1
USUAL_ABSENCE = 0.5
"""Seconds of simulated time until a component is back: about what a restart takes under the real clock."""


class FaultKind(Enum):
    """The way in which a component fails."""

    KILL = "kill"
    STOP = "stop"
    HANG = "hang"
    EXCEPTION = "exception"
    SLOW = "slow"

    @property
    def ends_the_run(self) -> bool:
        """Whether the component's process ends by it."""
        return self in (FaultKind.KILL, FaultKind.STOP, FaultKind.HANG)


@message("regraft/ScheduledFault")
@dataclass(frozen=True, slots=True)
class ScheduledFault:
    """A fault of ``component`` at the time ``at``: simulated, or since the start under the real clock.

    ``delay`` is how much longer each handler takes by the clock on the wall, once it is slow. ``back_after`` is the
    simulated time until the next run of a component joins whose run has ended.
    """

    at: Annotated[float, Unit("s"), Bounds(0.0, LONGEST)]
    component: str
    kind: FaultKind
    delay: Annotated[float, Unit("s"), Bounds(0.0, 60.0)] = USUAL_DELAY
    back_after: Annotated[float, Unit("s"), Bounds(0.0, LONGEST)] = USUAL_ABSENCE

    @property
    def until(self) -> float:
        """Return when the component is back."""
        return self.at + self.back_after

    def __str__(self) -> str:
        """Return it as the command line takes it."""
        return f"{self.at:g} {self.component} {self.kind.value}"
