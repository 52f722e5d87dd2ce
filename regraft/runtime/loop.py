"""The loop of a component under the real clock, and what all loops share."""

from __future__ import annotations

import time

from regraft.bus_schema.model.lifecycle import State
from regraft.runtime.lifecycle.lifecycle import TransitionFailed
from regraft.runtime.runtime import Runtime

NEVER = 3600.0
MAX_AT_ONCE = 1000
MAX_SECONDS_AT_ONCE = 0.05
"""Items taken from the inbox, and seconds spent on them, before timers and the heartbeat get their turn."""

MAX_WAITING = 10_000
"""Items that may wait in the inbox: a component that cannot keep up loses messages, and reports it, so as not to grow.
"""


def start(runtime: Runtime) -> None:
    """Appear on the bus and go to the assigned state; a successor, when and as it takes over."""
    if runtime.assignment.succeeds is not None:
        runtime.handover.stand_by()
        return
    runtime.declare()
    reach(runtime, runtime.assignment.state)


def reach(runtime: Runtime, state: State) -> None:
    """Go to a state; a hook that fails is reported, and leaves the component where it then is."""
    try:
        runtime.lifecycle.reach(state)
    except TransitionFailed as error:
        runtime.reporter.event("component.fault", f"did not become {state.value}: {error}")


def pump(runtime: Runtime) -> float:
    """Do everything that is due now; returns the seconds until something is due again, if nothing arrives."""
    runtime.work()
    runtime.fire()
    runtime.end_goals_of_nobody()
    runtime.mark_for_late_readers()
    now = runtime.clock.now()
    give_up_on_holes(runtime, now)
    runtime.work()
    runtime.answering.answer_parked()
    runtime.work()  # an input that has moved may have a lot to handle
    wait = runtime.reporter.beat_if_due()
    for due in (runtime.timers.next_due(), runtime.inbound.next_give_up()):
        if due is not None:
            wait = min(wait, max(0.0, (due - now) / 1e9))
    parked = runtime.answering.seconds_to_next()
    return wait if parked is None else min(wait, parked)


def give_up_on_holes(runtime: Runtime, now: int) -> None:
    """Continue behind holes that have stayed open for too long, but first take all that has come until ``now``.

    The missing messages may be among it: a handler took its time.
    """
    inbound = runtime.inbound
    if runtime.inbox.empty():
        inbound.give_up_on_holes(now)
        return
    due = inbound.next_give_up()
    if due is None or due > now or inbound.giving_up:
        return

    def give_up() -> None:
        inbound.giving_up = False
        inbound.give_up_on_holes(now)

    inbound.giving_up = True
    runtime.post(give_up)


def next_due(runtime: Runtime) -> float:
    """Do what is due now; returns when something is due again (monotonic seconds).

    Between two messages there is mostly nothing to do, and finding that out must cost next to nothing: what a
    component does after its answer still delays the whole machine.
    """
    if runtime.has_work or runtime.inbound.holes or runtime.answering.parked:
        return pump(runtime) + time.monotonic()
    now, then = time.monotonic(), runtime.reporter.next_beat
    if runtime.timers.in_use:
        due = runtime.timers.next_due()
        if due is not None:
            then = min(then, now + (due - runtime.clock.now()) / 1e9)
    return then if then > now else pump(runtime) + time.monotonic()


def run(runtime: Runtime) -> None:
    """Run until the component is finalized. A posted shutdown ends it."""
    start(runtime)
    while runtime.reporter.status.state is not State.FINALIZED:
        item = runtime.inbox.get_until(next_due(runtime))
        if item is not None:
            runtime.take(item)
            runtime.work()
            if not runtime.inbox.empty():
                catch_up(runtime)


def catch_up(runtime: Runtime) -> None:
    """Take what has come meanwhile; a component that falls behind for good loses messages rather than grow for ever."""
    taken, until = 0, time.monotonic() + MAX_SECONDS_AT_ONCE
    while not runtime.inbox.empty() and taken < MAX_AT_ONCE and time.monotonic() < until:
        runtime.take(runtime.inbox.get(0.0))
        runtime.work()
        taken += 1
    if runtime.inbox.qsize() > MAX_WAITING:
        shed(runtime)


def shed(runtime: Runtime) -> None:
    """Let messages of topics go by until half of what may wait is left; the holes in their numbering are reported."""
    runtime.repair.rest()
    for _ in range(runtime.inbox.qsize() - MAX_WAITING // 2):
        runtime.take_unless_data(runtime.inbox.get(0.0))
        runtime.work()
