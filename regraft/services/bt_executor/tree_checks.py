"""Checks trees next to a running mission: they are made on another thread, and forgotten."""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from behavior_tree import Blackboard, Registry, TreeLibrary
from regraft import RefusalCode, RequestRefused
from regraft.services.bt_executor.source import LIMITS, Source

if TYPE_CHECKING:
    from regraft import Kit

CHECK_LIMITS: Final = replace(LIMITS, seconds=3.0)
"""A tree that takes longer could not be loaded: see the executor's ``handler_timeout``."""
MAX_CHECKS: Final = 4
"""Trees that are being checked, or wait for that, at once."""
USUAL_INTERVAL: Final = sys.getswitchinterval()
"""Seconds after which a thread of Python gives way to another: 5 ms."""
CHECK_INTERVAL: Final = USUAL_INTERVAL / 10
"""The same while a tree is checked. A tick waits so long each time that it comes back from a file or the bus."""


class TreeChecks:
    """The checks that are under way in one executor."""

    def __init__(self, kit: Kit) -> None:
        self._kit = kit
        self._under_way = 0

    async def check(
        self, source: Source, registry: Registry, board: Blackboard, library: TreeLibrary | None = None
    ) -> None:
        """Make the tree of a source while the mission continues.

        Raises:
            Unloadable: it cannot be built, or that takes too long.
            RequestRefused: too many trees are being checked.
        """
        if self._under_way >= MAX_CHECKS:
            raise RequestRefused(f"{self._under_way} trees are being checked: check this one later", RefusalCode.BUSY)
        self._under_way += 1
        sys.setswitchinterval(CHECK_INTERVAL)
        try:
            await self._kit.compute(source.load, registry, board, CHECK_LIMITS, library)
        finally:
            self._under_way -= 1
            if not self._under_way:
                sys.setswitchinterval(USUAL_INTERVAL)
