"""Kills what decides, carries out and observes, at each step of switches between realizations."""

from __future__ import annotations

from regraft import run_directory
from tests.metacontrol.patrol.running import Patrol
from tests.support.waiting import wait_until

VICTIMS = ("metacontrol", "adaptation_manager", "component_observer", "quality_observer")
DEGRADING = ("camera activate", "controller_server set", "amcl set", "pointcloud_to_laser activate")
RETURNING = ("laser_resender configure", "laser_resender activate", "controller_server set", "amcl set")
"""Steps of a switch, as the components come to them."""


def switch_through_kills(patrol: Patrol, kills: int) -> list[str]:
    """Break and mend the laser in turns, with a kill at a step of each switch; after each, one realization runs whole.

    All that runs is read from the processes themselves: neither from the journal nor from the metacontroller. Return
    the killed components, and the steps.
    """
    file = run_directory.folder("tests") / "kills"
    struck = []
    patrol.add()
    patrol.wait_for_realization("normal")
    for number in range(kills):
        victim = VICTIMS[number % len(VICTIMS)]
        run = patrol.wait_running(victim)
        steps = RETURNING if number % 2 else DEGRADING
        step = steps[number // len(VICTIMS) % len(steps)]
        file.write_text(f"{step} {run.pid}")
        patrol.put(laser_resender=bool(number % 2))
        wait_until(lambda: not file.exists(), f"the step {step!r}")
        struck.append(f"{victim} at {step}")
        patrol.wait_running(victim, run.incarnation + 1)
        patrol.wait_for_realization("normal" if number % 2 else "degraded")
    return struck
