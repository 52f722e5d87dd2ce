"""A robot that drives to its dock and charges, and what that takes."""

from __future__ import annotations

from dataclasses import dataclass

from regraft.bus_schema.messages.power import BatteryState, Charge, Charged, ChargeProgress, ChargerState
from regraft.bus_schema.messages.world import GroundTruth
from regraft.services.battery import Battery
from regraft.services.charging.docking import Docking
from regraft.services.navigator.navigator import Navigator
from regraft.sim_service.map_server import MapServer
from regraft.testing import Rig
from tests.services.rigs import TICK, finish, run, run_until, world_on
from tests.support.worlds import FROG_WORLD

CAPACITY, CHARGE, UNTIL = 2000.0, 0.95, 0.97


@dataclass(frozen=True)
class Charging:
    """Times (s), energy (J) and power (W) that it took, and the power that was told while charging."""

    distance: float
    docking_time: float
    docking_energy: float
    net_power: float
    charging_time: float
    evaluated_power: float


def charge(seed: int) -> tuple[dict[str, float], Charging]:
    """Charge once in a room; returns what was estimated and what it took."""
    with Rig(seed=seed) as rig:
        world = world_on(rig)
        rig.add(MapServer, "map_server", FROG_WORLD)
        rig.add(Navigator)
        battery = rig.add(Battery, parameters={"capacity": CAPACITY, "initial_charge": CHARGE})
        docking = rig.add(Docking)
        truth, states = rig.collect("ground_truth", GroundTruth), rig.collect("battery", BatteryState)
        chargers = rig.collect("charger", ChargerState)
        run(rig, world, 2.0)
        first, begun, drawn = len(truth), states[-1], battery.evaluate()["drawn"]
        goal = rig.goal("charge", Charge(UNTIL), Charged, ChargeProgress)
        run_until(rig, world, lambda: goal.done or chargers[-1].connected, within=120.0)
        spent, arrived = battery.evaluate()["drawn"] - drawn, truth[-1].stamp
        run(rig, world, 5.0)
        told_now, rising = docking.evaluate()["net_power"], states[-1]
        finish(rig, world, goal)
        assert goal.result is not None, goal.error
        assert goal.result.charged, goal.result.reason
    distance = TICK * sum(abs(told.twist.forward) for told in truth if truth[first].stamp <= told.stamp <= arrived)
    context = {"charge": begun.charge, "until": UNTIL, "capacity": CAPACITY, "distance": distance}
    power = (states[-1].energy - rising.energy) / (states[-1].stamp - rising.stamp)
    took = Charging(
        distance,
        arrived - truth[first].stamp,
        spent,
        power,
        truth[-1].stamp - arrived,
        told_now,
    )
    return Docking.estimate({}, dict(context)), took
