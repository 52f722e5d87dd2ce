"""Holding an exclusive slot, the same for members and for the source of time."""

from __future__ import annotations

from collections.abc import Callable

from regraft.bus_schema.model.lifecycle import State
from regraft.runtime.core.exclusive import WaitsForEver
from regraft.runtime.runtime import Runtime


def hold_slot(
    runtime: Runtime, outside: tuple[str, ...], pump: Callable[[], object], settle: Callable[[], object]
) -> tuple[str, ...]:
    """Let in what came from ``outside``, and hold the slot until no task needs it; returns who was touched in it.

    ``pump`` takes what arrives, waiting a little; ``settle`` finishes all that was begun.
    """
    runtime.inbound.release_outside(outside)
    runtime.slots.grant()
    settle()
    while runtime.slots.holders and runtime.state is not State.FINALIZED:
        if runtime.slots.free():
            runtime.reporter.fault("exclusive slot", WaitsForEver())
        else:
            pump()
        settle()
    return runtime.slots.withdraw()
