"""Watches how well the scans fit the map, and searches for a robot that is lost."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from regraft.bus_schema.messages.health import Level
from regraft.services.mapper.mapping import Mapping
from regraft.services.mapper.matching.localizer import CERTAIN, MIN_EXPECTED
from regraft.services.mapper.matching.search import search_everywhere
from regraft.services.mapper.troubles import Troubles

if TYPE_CHECKING:
    from regraft import Kit

SEARCH_INTERVAL = 2.0
"""s between searches of the map for a robot that is lost."""
SEARCH_REACH = 5.0
"""m to either side of where it should be that are searched: what takes longer than a second is of no use."""


class FitWatch:
    """Reports when the scans do not fit the map any more and when they do again; meanwhile it searches the map."""

    def __init__(self, kit: Kit, mapping: Mapping, troubles: Troubles) -> None:
        """Watch a component's mapping; events are called ``mapper.lost`` and ``mapper.found``."""
        self._kit = kit
        self._mapping = mapping
        self._troubles = troubles
        self._searching = False
        self._searched_at = -math.inf

    def start(self) -> None:
        """Begin again: a search that was under way has ended with the component's activity."""
        self._searching = False

    def look(self) -> None:
        """Judge the localizer's result for the last scan."""
        localizer, fix, now = self._mapping.localizer, self._mapping.fix, self._kit.now()
        ratio = fix.match.ratio if fix and fix.match else 1.0
        if localizer.lost:
            text = f"only {ratio:.0%} of the echoes fit the map: the robot was moved, or its surroundings changed"
            if self._troubles.note("localization", Level.ERROR, text, now, inlier_ratio=ratio):
                self._kit.event("mapper.lost", text, inlier_ratio=ratio)
            self._search(now)
        elif fix and fix.fits:
            text = "the scans fit the map"
            if self._troubles.note("localization", None, text, now, inlier_ratio=ratio):
                self._kit.event("mapper.found", text, inlier_ratio=ratio)

    def _search(self, now: float) -> None:
        last, grid = self._mapping.last_scan(), self._mapping.grid
        if self._searching or last is None or grid is None or now - self._searched_at < SEARCH_INTERVAL:
            return
        self._searching, self._searched_at = True, now
        self._kit.spawn(self._search_everywhere(), "search")

    async def _search_everywhere(self) -> None:
        """Look for the robot on the map; the scans after that show whether it is there."""
        last, grid = self._mapping.last_scan(), self._mapping.grid
        assert last is not None
        assert grid is not None
        scan, odometry = last
        guess = self._mapping.in_map(odometry)
        window = grid.window(guess.x, guess.y, SEARCH_REACH).copy()
        try:
            found = await self._kit.compute(search_everywhere, window, scan.points())
        finally:
            self._searching = False
        still_there = self._mapping.localizer.lost and grid is self._mapping.grid
        if still_there and found and found.inliers >= MIN_EXPECTED and found.ratio >= CERTAIN:
            self._mapping.suppose(found, odometry)
