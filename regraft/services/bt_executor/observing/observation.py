"""Counts and records what a mission's nodes do, as long as that is asked for."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from behavior_tree import Tree, TreeObserver
from regraft import RefusalCode, RequestRefused
from regraft.bus_schema.messages.mission import MissionCounts, MissionTransitions, NodeCounts
from regraft.services.bt_executor.mission import Mission
from regraft.services.bt_executor.observing.recording import Recording
from regraft.services.bt_executor.structure import STATUSES


class Observation:
    """The counts of the present tree's nodes, and the recording.

    Attributes:
        recording: Where changes are recorded, None if they are not.
    """

    def __init__(self) -> None:
        self.recording: Recording | None = None
        self._counts = False
        self._observer: TreeObserver | None = None

    def count(self, tree: Tree | None, wanted: bool) -> None:
        """Count what a tree does from now on, or no more; a tree that is counted already stays so."""
        if wanted and tree is not None and self._observer is None:
            self._observer = TreeObserver(tree)
        elif not wanted and self._observer is not None:
            self._observer.detach()
            self._observer = None
        self._counts = wanted

    def follow(self, tree: Tree) -> None:
        """Count what another tree does, from zero, if counts are wanted."""
        self._observer = TreeObserver(tree) if self._counts else None

    def record(self, path: str, report: Callable[[str], object]) -> None:
        """Begin another recording, or end the one that there is for an empty path."""
        self.recording = Recording(Path(path), report) if path else None

    def take(self, mission: Mission, batch: MissionTransitions) -> None:
        """Record the changes of a tick."""
        if self.recording is not None and mission.tree is not None:
            self.recording.write(mission.tree.tree_id, mission.nodes(), batch)

    def counts(self, mission: Mission, now: float, reset: bool) -> MissionCounts:
        """Return the counts, and begin again from zero if that is wanted; raises RequestRefused if there are none."""
        tree, observer = mission.tree, self._observer
        if tree is None or observer is None:
            raise RequestRefused("nodes are not counted: set the parameter 'counts' to true", RefusalCode.CONFLICT)
        counted = tuple(
            NodeCounts(
                node.uid,
                counts.ticks,
                counts.successes,
                counts.failures,
                counts.skips,
                counts.transitions,
                STATUSES[counts.last_result],
                counts.last_time,
            )
            for node, counts in zip(tree.nodes, observer.counts, strict=True)
        )
        if reset:
            observer.reset()
        return MissionCounts(now, mission.structure, counted)
