"""Requirements of the whole system."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Final

from behavior_tree import Node
from regraft.bus_schema.messages.quality import QualityLevel
from regraft.services.bt_executor.quality.over_time import Unknown
from regraft.services.bt_executor.quality.requirement_node import QualityRequirement
from regraft.services.bt_executor.quality.task_level import TaskLevelQR
from regraft.services.bt_executor.quality.verdict import Verdict


@dataclass(frozen=True, slots=True)
class Gathered:
    """A task-level requirement that is active below a system-level one: what is known of it, and its weight."""

    type_id: str
    name: str
    verdict: Verdict
    weight: float


class SystemLevelQR(QualityRequirement):
    """A quality requirement of the whole system, which may take in those of the tasks that are running below it.

    `gathered` gives the task-level requirements of the same quality attribute in its whole sub-tree, through SubTree
    nodes, that are active: their child is running. A system-level requirement below is left out, because it represents
    the same tasks.
    """

    level: ClassVar[QualityLevel] = QualityLevel.SYSTEM

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Take the child, and note the task-level requirements below; see `Node.adopt`."""
        super().adopt(children)
        self._below = _told_apart(_tasks_below(self))

    def gathered(self) -> dict[str, Gathered]:
        """Return the requirements of the same attribute that are active below, by path, in the tree's order."""
        return {
            path: Gathered(task.type_id, task.name, task.verdict, task.told_weight)
            for path, task in self._below.items()
            if task.is_active and task.told_attribute == self.told_attribute
        }

    def gathered_metrics(self) -> list[tuple[float, float]]:
        """Return metric and weight of each of the `gathered`.

        Raises:
            Unknown: one of the metrics is unknown; a combination of the others would mean something else.
        """
        metrics = []
        for path, task in self.gathered().items():
            if task.verdict.metric.value is None:
                raise Unknown(f"'{path}' is unknown: {task.verdict.metric.reason}")
            metrics.append((task.verdict.metric.value, task.weight))
        return metrics


def _tasks_below(node: Node) -> Iterable[TaskLevelQR]:
    pending = list(reversed(node.children))
    while pending:
        found = pending.pop()
        if isinstance(found, TaskLevelQR):
            yield found
        pending.extend(reversed(found.children))


def _told_apart(tasks: Iterable[TaskLevelQR]) -> dict[str, TaskLevelQR]:
    """Return requirements by path, siblings of one name by path and uid."""
    apart: dict[str, TaskLevelQR] = {}
    for task in tasks:
        apart[task.path if task.path not in apart else f"{task.path}::{task.uid}"] = task
    return apart


def _weighted_mean(metrics: Sequence[tuple[float, float]]) -> float:
    weights = sum(weight for _, weight in metrics)
    if weights == 0.0:
        raise Unknown("all weights are 0")
    return sum(metric * weight for metric, weight in metrics) / weights


SUM: Final = "sum"
COMBINATIONS: Final[Mapping[str, Callable[[Sequence[tuple[float, float]]], float]]] = {
    SUM: lambda metrics: sum((metric for metric, _ in metrics), 0.0),
    "mean": lambda metrics: sum(metric for metric, _ in metrics) / len(metrics),
    "min": lambda metrics: min(metric for metric, _ in metrics),
    "max": lambda metrics: max(metric for metric, _ in metrics),
    "weighted_mean": _weighted_mean,
}
"""Ways to make one number of metrics and their weights; only the weighted mean, sum(w m) / sum(w), asks the weights."""


def combined(metrics: Sequence[tuple[float, float]], how: str) -> float:
    """Return one number for (metric, weight) pairs, in one of the `COMBINATIONS`; the sum of none is 0.

    Raises:
        Unknown: there is nothing of which a mean, least or greatest could be taken, or no such way.
    """
    if how not in COMBINATIONS:
        raise Unknown(f"'{how}' is no way to combine metrics; use one of {', '.join(COMBINATIONS)}")
    if not metrics and how != SUM:
        raise Unknown("no requirement is active below, so there is nothing to combine")
    return COMBINATIONS[how](metrics)
