"""Charging over twenty placements: the dock is found, nothing is touched, the battery is never empty."""

from __future__ import annotations

import math

import pytest

from regraft.bus_schema.messages.power import BatteryState, Charge, Charged, ChargeProgress
from regraft.bus_schema.messages.world import GroundTruth
from regraft.services.battery import Battery
from regraft.services.charging.docking import Docking
from regraft.services.navigator.navigator import Navigator
from regraft.sim_service.map_server import MapServer
from regraft.testing import Rig
from tests.services.rigs import finish, run, world_on
from tests.support.worlds import FROG_WORLD

pytestmark = [pytest.mark.evidence, pytest.mark.timeout(1800)]

ASIDE = 0.2
"""m: how far from where the robot believes the dock to be it really is, in the second half of the seeds."""


def test_frog_charges_wherever_it_starts_even_where_the_dock_is_not_where_it_should_be() -> None:
    print("seed  dock aside  start  seconds  lowest charge  end  approaches  contacts")
    for seed in range(1, 21):
        aside = ASIDE if seed > 10 else 0.0
        with Rig(seed=seed) as rig:
            world = world_on(rig)
            rig.add(MapServer, "map_server", FROG_WORLD)
            rig.add(Navigator)
            rig.add(Battery, parameters={"capacity": 2000.0, "initial_charge": 0.92})
            docking = rig.add(Docking, parameters={"dock_x": aside, "dock_y": -aside / 2})
            truth, states = rig.collect("ground_truth", GroundTruth), rig.collect("battery", BatteryState)
            run(rig, world, 2.0)
            start, begun = truth[-1].pose, truth[-1].stamp
            goal = rig.goal("charge", Charge(0.98), Charged, ChargeProgress)
            finish(rig, world, goal, within=240.0)
            assert goal.result is not None, goal.error
            approaches = docking.evaluate()["approaches"]
        end, lowest = truth[-1].pose, min(state.charge for state in states)
        print(
            f"{seed:4} {aside:10.2f} {math.hypot(start.x, start.y):7.2f} {truth[-1].stamp - begun:8.1f} {lowest:13.3f}"
            f" {math.hypot(end.x, end.y):6.3f} {approaches:8.0f} {truth[-1].contacts:10}"
        )
        assert goal.result.charged, goal.result.reason
        assert truth[-1].contacts == 0
        assert lowest > 0.5
