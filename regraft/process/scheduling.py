"""How the processes of a system in simulated time share the processors.

By themselves, processes are interrupted when another one has something to do. In simulated time nobody is in a
hurry: all of a tick has to be done before the next begins. Processes that the kernel takes for batch work run until
they wait. Measured with FROG at full speed on two processors: two thirds of the switches between processes, 6 % less
processor time, 11 % faster.
"""

from __future__ import annotations

import contextlib
import os


def work_in_batches() -> bool:
    """Make this process, and those that it starts from now on, batch work; call it while it has one thread.

    A policy that a user has set is kept. Returns False then, and where there is no such policy (macOS).
    """
    if not hasattr(os, "SCHED_BATCH") or os.sched_getscheduler(0) != os.SCHED_OTHER:
        return False
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))
        return True
    return False
