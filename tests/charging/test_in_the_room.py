"""Promises of charging with the real battery, navigator and world."""

import math

import pytest

from regraft.bus_schema.messages.power import BatteryState, Charge, Charged, ChargeProgress
from regraft.bus_schema.messages.world import GroundTruth
from regraft.services.battery import Battery
from regraft.services.charging.docking import Docking
from regraft.services.navigator.navigator import Navigator
from regraft.services.power_model import total_power
from regraft.sim_service.map_server import MapServer
from regraft.testing import Rig
from tests.support.worlds import FROG_WORLD

from ..services.rigs import finish, run, world_on

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("seed", [2, 5])
def test_frog_finds_its_dock_charges_and_touches_nothing(seed: int) -> None:
    with Rig(seed=seed) as rig:
        world = world_on(rig)
        rig.add(MapServer, "map_server", FROG_WORLD)
        rig.add(Navigator)
        battery = rig.add(Battery, parameters={"capacity": 2000.0, "initial_charge": 0.95})
        docking = rig.add(Docking)
        truth, states = rig.collect("ground_truth", GroundTruth), rig.collect("battery", BatteryState)
        run(rig, world, 2.0)
        goal = rig.goal("charge", Charge(0.96), Charged, ChargeProgress)
        finish(rig, world, goal, within=90.0)
        assert goal.result is not None, goal.error
        assert goal.result.charged, goal.result.reason
        assert docking.evaluate() == pytest.approx(
            {"docked": 1.0, "approaches": 1.0, "net_power": 20.0 - total_power(0.0)}
        )
    pose = truth[-1].pose
    assert math.hypot(pose.x, pose.y) <= 0.15
    assert abs(pose.yaw) < 0.2
    assert truth[-1].contacts == 0
    assert states[-1].charge >= 0.96
    account = battery.evaluate()
    assert states[-1].energy == pytest.approx(1900.0 + account["charged"] - account["drawn"])
