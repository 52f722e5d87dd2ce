"""Requirements of a task."""

from __future__ import annotations

from typing import ClassVar

from regraft.bus_schema.messages.quality import QualityLevel
from regraft.services.bt_executor.quality.requirement_node import QualityRequirement


class TaskLevelQR(QualityRequirement):
    """A quality requirement of the task below it.

        class KeepDistance(TaskLevelQR):
            "Stays away from things."

            attribute = "Safety"
            nearest = Input(float, description="distance of the nearest obstacle, in metres")
            least = Input(float, default=0.5, description="the least distance, in metres")

            def measure(self) -> float | None:
                return self.nearest

            def is_satisfied(self, metric: float) -> bool:
                return metric >= self.least

    Override `measure`; `is_satisfied` or `degree_of` if something is required; `on_start` and `on_end` for measures of
    a whole run; `status_text` for words of your own.
    """

    level: ClassVar[QualityLevel] = QualityLevel.TASK
