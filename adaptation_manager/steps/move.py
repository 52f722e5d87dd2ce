"""``move``: what still runs, and what was on a lost host."""

from __future__ import annotations

from adaptation_manager.steps import rescue, unsupported
from adaptation_manager.steps.draft import Draft
from bus_schema.adaptation import Move


def plan(draft: Draft, change: Move) -> None:
    """Add the change to the draft."""
    if rescue.is_rescue(draft, change):
        rescue.plan(draft, change)
    else:
        unsupported.plan(draft, change)
