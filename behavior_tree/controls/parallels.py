"""Nodes that tick several unfinished children in one tick."""

from ..nodes.control_node import Control
from ..nodes.node import Node, NodeSetup
from ..nodes.ports import Input
from ..status import FAILURE, RUNNING, SKIPPED, SUCCESS, Status


def _from_end(count: int, children: int) -> int:
    """Return a threshold; negative ones count from the number of children, -1 meaning all."""
    return count if count >= 0 else max(children + count + 1, 0)


class _Concurrent(Control):
    """The base of the two parallel nodes: the set of completed children and how many of them failed."""

    thresholds: tuple[str, ...] = ()

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._completed: set[int] = set()
        self._failures = 0

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Take the children and check thresholds given as literals."""
        super().adopt(children)
        for name in self.thresholds:
            if self.has_literal(name):
                self._check_threshold(name, self.read_port(name))

    def halt(self) -> None:
        """Reset all children and forget which had completed."""
        self._clear()
        super().halt()

    def _check_threshold(self, name: str, count: int) -> int:
        needed = _from_end(count, len(self.children))
        if needed > len(self.children):
            raise ValueError(f"{name} is {count}, more than the {len(self.children)} children")
        return needed

    def _count(self, index: int, status: Status) -> None:
        self._completed.add(index)
        if status == FAILURE:
            self._failures += 1

    def _finish(self, status: Status) -> Status:
        self._clear()
        self.reset_children()
        return status

    def _clear(self) -> None:
        self._completed.clear()
        self._failures = 0


class Parallel(_Concurrent):
    """Ticks its children side by side until enough have succeeded, or too many have failed."""

    thresholds = ("success_count", "failure_count")

    success_count = Input(int, default=-1, description="successes needed; -1: all children, -2: all but one, …")
    failure_count = Input(int, default=1, description="failures that make it fail; negative as above")

    def tick(self) -> Status:
        """Tick every unfinished child once, as long as the result is open."""
        success_count = self.success_count
        needed = self._check_threshold("success_count", success_count)
        tolerated = self._check_threshold("failure_count", self.failure_count)
        self.set_running()
        children = len(self.children)
        completed = self._completed
        skipped = 0
        for index, child in enumerate(self.children):
            if index not in completed:
                status = child.execute_tick()
                if status == SKIPPED:
                    skipped += 1
                elif status != RUNNING:
                    self._count(index, status)
                elif index:
                    continue  # A running child changes no count; only the first look does not depend on that.
            successes = len(completed) - self._failures
            if successes >= needed or (success_count < 0 and successes + skipped >= needed):
                return self._finish(SUCCESS)
            if children - self._failures < needed or self._failures == tolerated:
                return self._finish(FAILURE)
        return SKIPPED if skipped == children else RUNNING


class ParallelAll(_Concurrent):
    """Ticks its children side by side until all have completed, then counts the failures."""

    thresholds = ("max_failures",)

    max_failures = Input(int, default=1, description="failures from which on it fails; -1: as many as children, …")

    def tick(self) -> Status:
        """Tick every unfinished child once."""
        limit = self._check_threshold("max_failures", self.max_failures)
        self.set_running()
        children = len(self.children)
        skipped = 0
        for index, child in enumerate(self.children):
            if index in self._completed:
                continue
            status = child.execute_tick()
            if status == SKIPPED:
                skipped += 1
            elif status != RUNNING:
                self._count(index, status)
        if skipped == children:
            return SKIPPED
        if skipped + len(self._completed) < children:
            return RUNNING
        return self._finish(FAILURE if self._failures >= limit else SUCCESS)
