"""The verdict on a requirement, and its listeners."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Protocol

from behavior_tree import TreeError
from regraft.bus_schema.messages.quality import Quality
from regraft.services.bt_executor.quality.over_time import Metric

UNKNOWN: Final = "unknown"
"""The status of a requirement whose metric is unknown."""
MAX_TEXT_LENGTH: Final = 500


class QualityTeller(Protocol):
    """Takes how requirements are met: the executor's `LeafContext`."""

    def report_quality(self, quality: Quality) -> None:
        """Take what is known now."""
        ...


@dataclass(frozen=True, slots=True)
class Verdict:
    """The state of a requirement.

    Attributes:
        metric: The measure.
        satisfied: Whether the requirement is met, None if that is unknown or nothing is required.
        degree: How far it is met, in [0, 1], None likewise.
        status: A word for people and trees.
    """

    metric: Metric
    satisfied: bool | None = None
    degree: float | None = None
    status: str = UNKNOWN


def explained(error: Exception) -> str:
    """Return what went wrong, for the reason why a metric is unknown."""
    if isinstance(error, TreeError):
        return error.message
    return f"{type(error).__name__}: {error}"


def sendable(text: str) -> str:
    """Return text as it can travel: not too long, and well-formed."""
    return str(text)[:MAX_TEXT_LENGTH].encode("utf-8", "replace").decode()
