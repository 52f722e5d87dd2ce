"""Kills what decides, carries out and observes, in the middle of switches between realizations."""

from __future__ import annotations

import os
import random
import signal
import time

from tests.metacontrol.patrol.running import Patrol

VICTIMS = ("metacontrol", "adaptation_manager", "component_observer", "quality_observer")
LONGEST = 0.6
"""Seconds from the failure to the kill: by then, a switch is over that nobody disturbs."""


def switch_through_kills(patrol: Patrol, kills: int, seed: int) -> None:
    """Break and mend the laser in turns, with a kill in each switch; after each, just one realization runs.

    What runs is read from the processes themselves: neither from the journal nor from the metacontroller.
    """
    chance = random.Random(seed)
    patrol.add()
    patrol.wait_for_realization("normal")
    for number in range(kills):
        victim = VICTIMS[number % len(VICTIMS)]
        run = patrol.wait_running(victim)
        is_well = bool(number % 2)
        patrol.put(laser_resender=is_well)
        time.sleep(chance.uniform(0.0, LONGEST))
        os.kill(run.pid, signal.SIGKILL)
        patrol.wait_running(victim, run.incarnation + 1)
        patrol.wait_for_realization("normal" if is_well else "degraded")
