"""Gathers the changes of nodes' statuses for those who follow a mission."""

from __future__ import annotations

from typing import Final

from behavior_tree import Status
from regraft.bus_schema.messages.mission import MissionTransition, MissionTransitions
from regraft.services.bt_executor.mission import Mission
from regraft.services.bt_executor.structure import STATUSES

MAX_AT_ONCE: Final = 5000
"""Changes in one message; an endless loop of leaves that complete at once makes any number in a tick."""


class TransitionLog:
    """The changes since they were last taken.

    Attributes:
        listening: Whether anybody wants them; else nothing is kept.
    """

    def __init__(self) -> None:
        self.listening = False
        self._changes: list[MissionTransition] = []
        self._missed = 0

    def note(self, uid: int, before: Status, after: Status, stamp: float) -> None:
        """Keep a change; a tree calls this."""
        if not self.listening:
            return
        if len(self._changes) < MAX_AT_ONCE:
            self._changes.append(MissionTransition(uid, STATUSES[before], STATUSES[after], stamp))
        else:
            self._missed += 1

    def take(self, mission: Mission, now: float) -> MissionTransitions | None:
        """Return what was kept, as of the mission's present tree; None if nothing was."""
        if not self._changes:
            return None
        taken = MissionTransitions(now, mission.structure, mission.ticks, tuple(self._changes), self._missed)
        self._changes.clear()
        self._missed = 0
        return taken
