"""The loop of a component under the real clock, and what all loops share."""

from __future__ import annotations

import queue
import time
from typing import Any

from bus_schema.lifecycle import State
from regraft.runtime.lifecycle import TransitionFailed
from regraft.runtime.runtime import Runtime

NEVER = 3600.0
MOST_AT_ONCE = 1000
LONGEST_AT_ONCE = 0.05
"""Items taken from the inbox, and seconds spent on them, before timers and the heartbeat get their turn."""

MOST_WAITING = 10_000
"""Items that may wait in the inbox: whoever cannot keep up loses messages, and says so, rather than grow for ever."""


def get(inbox: queue.SimpleQueue[Any], timeout: float) -> Any:
    """Return the next item, None after ``timeout`` seconds."""
    try:
        return inbox.get(timeout=timeout) if timeout > 0 else inbox.get_nowait()
    except queue.Empty:
        return None


def start(runtime: Runtime) -> None:
    """Appear on the bus and go to the assigned state."""
    runtime.declare()
    reach(runtime, runtime.assignment.state)


def reach(runtime: Runtime, state: State) -> None:
    """Go to a state; a hook that fails is reported, and leaves the component where it then is."""
    try:
        runtime.lifecycle.reach(state)
    except TransitionFailed as error:
        runtime.herald.event("component.fault", f"did not become {state.value}: {error}")


def pump(runtime: Runtime) -> float:
    """Do everything that is due now; returns the seconds until something is due again, if nothing arrives."""
    runtime.work()
    runtime.fire()
    now = runtime.clock.now()
    runtime.inbound.give_up_on_holes(now)
    runtime.work()
    runtime.control.answer_parked()
    wait = runtime.herald.beat_if_due()
    for due in (runtime.timers.next_due(), runtime.inbound.next_give_up()):
        if due is not None:
            wait = min(wait, max(0.0, (due - now) / 1e9))
    parked = runtime.control.seconds_to_next()
    return wait if parked is None else min(wait, parked)


def run(runtime: Runtime) -> None:
    """Run until the component is finalized. Whoever wants it to end posts a shutdown."""
    start(runtime)
    while runtime.state is not State.FINALIZED:
        item = get(runtime.inbox, pump(runtime))
        taken, until = 0, time.monotonic() + LONGEST_AT_ONCE
        while item is not None:
            runtime.take(item)
            runtime.work()
            taken += 1
            item = get(runtime.inbox, 0.0) if taken < MOST_AT_ONCE and time.monotonic() < until else None
        if runtime.inbox.qsize() > MOST_WAITING:
            shed(runtime)


def shed(runtime: Runtime) -> None:
    """Let messages of topics go by until half of what may wait is left; the holes in their numbering are reported."""
    for _ in range(runtime.inbox.qsize() - MOST_WAITING // 2):
        runtime.take_unless_data(get(runtime.inbox, 0.0))
        runtime.work()
