"""The last part of an adaptation that is kept: parts that it removed, and held until now, end."""

from __future__ import annotations

from collections.abc import Callable

from regraft.adaptation_manager.planning.plan import Plan
from regraft.adaptation_manager.targets.component_client import BESIDE, ControlFailed
from regraft.adaptation_manager.targets.context import ExecutionContext
from regraft.adaptation_manager.targets.handover import retire
from regraft.adaptation_manager.targets.processes import end_removed, end_strangers

GRACE = 3.0
"""Seconds that a process may take to end by itself."""


async def conclude(context: ExecutionContext, plan: Plan, tell: Callable[[str, str], object]) -> bool:
    """End what was removed, then the runs that were succeeded; failures are reported. Returns whether all has ended."""
    all_ended = await end_removed(context, plan.removed, tell)
    for component, host in plan.succeeded:
        all_ended &= await retire_or_tell(context, component, host, tell)
    return all_ended


async def clear_up(context: ExecutionContext, tell: Callable[[str, str], object]) -> bool:
    """End what runs and has no place in the architecture; failures are reported. Returns whether all has ended.

    A manager died, or a host was silent, when it was to end.
    """
    all_ended = await end_strangers(context, tell)
    for name in sorted(context.controls.processes):
        component = name.removesuffix(BESIDE)
        if component != name and component in context.after.components:
            host = context.hosts.where(context.controls.processes[name]) or context.after.components[component].host
            all_ended &= await retire_or_tell(context, component, host, tell)
    return all_ended


async def retire_or_tell(
    context: ExecutionContext, component: str, host: str, tell: Callable[[str, str], object]
) -> bool:
    """End the run next to a component; returns whether it has ended."""
    try:
        await retire(context, component, host, GRACE)
    except ControlFailed as error:
        tell("adaptation.unfinished", f"the run of {component} that was succeeded has not ended: {error}")
        return False
    return True
