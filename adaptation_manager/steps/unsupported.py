"""``swap`` and ``move``: changes that this version does not carry out yet."""

from __future__ import annotations

from adaptation_manager.steps.draft import Draft
from bus_schema.adaptation import Move, Swap


def plan(draft: Draft, change: Swap | Move) -> None:
    """Refuse the change."""
    draft.refuse(change.component, "change", f"{change.change} is not supported yet by this version")
