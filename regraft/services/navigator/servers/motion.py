"""A motion of the robot: what every one of them has, so that the controller server can carry it out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from regraft.planar import Twist2D
from regraft.services.navigator.driving.local_controller import Situation


@dataclass(frozen=True, slots=True)
class Ended:
    """The end of a motion, with the code of its error if it has one; ``cancelled`` by another than its client."""

    code: int = 0
    why: str = ""
    cancelled: bool = False


class Motion(Protocol):
    """Decides at each step of the server what the robot does, until it has `ended`."""

    ended: Ended | None

    @property
    def unknown(self) -> int:
        """The code of an error that has none of its own."""
        ...

    def step(self, time: float, now: Situation) -> Twist2D:
        """Return the twist to command at ``time`` (s); that of an ended motion counts for nothing."""
        ...

    def blind(self, time: float, why: str) -> None:
        """Take notice that the robot has to stand at ``time`` (s), because a sense is missing."""
        ...

    def end(self, ended: Ended) -> None:
        """End it, unless it has ended."""
        ...


@dataclass(slots=True)
class Patience:
    """For how long something may last, such as being blind or blocked."""

    longest: float
    since: float | None = None

    def is_over(self, time: float) -> bool:
        """Take notice at ``time`` (s) that it still lasts; return whether it does so for too long."""
        self.since = time if self.since is None else self.since
        return time - self.since > self.longest

    def reset(self) -> None:
        """Take notice that it does not last."""
        self.since = None
