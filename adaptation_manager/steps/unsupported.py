"""``move``: a change that this version does not carry out yet."""

from __future__ import annotations

from adaptation_manager.steps.draft import Draft
from bus_schema.adaptation import Move


def plan(draft: Draft, change: Move) -> None:
    """Refuse the change."""
    draft.refuse(change.component, "change", f"{change.change} is not supported yet by this version")
