"""Promises about beacons and their receivers."""

import math
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from regraft.bus_schema.messages.devices.ranging import BeaconSighting
from regraft.sim_service.devices.signals.beacon import Beacon, BeaconReceiver
from regraft.sim_service.layout.scene import SceneError
from regraft.sim_service.simulation import Simulation

from .worlds import FLOOR, PUCK, device, found, robot, run, simulated

BODY = PUCK + '<site name="beacon" pos="0 0 .05"/>'
EXACT: dict[str, Any] = {"bearing_noise": 0.0, "distance_noise": 0.0}
REACH = 0.8
"""m, by default."""
POST = '<body name="post" pos="{} 0 .1"><geom type="cylinder" size=".01 .1"/></body>'

Place = tuple[float, float, float]


def pair(folder: Path, there: Place, here: Place = (0.0, 0.0, 0.0), body: str = FLOOR, **how: Any) -> Simulation:
    """Return a robot with a receiver, and another with a beacon."""
    looking = robot(folder, "looking", [device(BeaconReceiver, **how)], here, body=BODY)
    shining = robot(folder, "shining", [device(Beacon)], there, body=BODY)
    return simulated(folder, looking, shining, body=body)


def seen(simulation: Simulation) -> tuple[BeaconSighting, ...]:
    """Return what the looking robot sees."""
    return found(simulation, BeaconReceiver, of="looking").measure().beacons


@settings(max_examples=20, deadline=None)
@given(st.floats(-3.0, 3.0), st.floats(0.1, 1.2), st.floats(-3.0, 3.0))
def test_bearing_and_distance_are_those_of_geometry(bearing: float, distance: float, yaw: float) -> None:
    assume(abs(distance - REACH) > 1e-6)  # there rounding decides
    with TemporaryDirectory() as folder:
        there = (distance * math.cos(bearing + yaw), distance * math.sin(bearing + yaw), 0.0)
        simulation = pair(Path(folder), there, (0.0, 0.0, yaw), **EXACT)
    if distance > REACH:
        assert seen(simulation) == ()
        return
    (beacon,) = seen(simulation)
    assert beacon.beacon == "shining"
    assert beacon.distance == pytest.approx(distance)
    assert math.remainder(beacon.bearing - bearing, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-6)


def test_a_body_between_hides_a_beacon_and_one_beside_does_not(tmp_path: Path) -> None:
    assert seen(pair(tmp_path, (0.5, 0.0, 0.0), body=FLOOR + POST.format(0.25))) == ()
    assert len(seen(pair(tmp_path, (0.5, 0.0, 0.0), body=FLOOR + POST.format(0.6)))) == 1


def test_a_third_robot_between_hides_a_beacon(tmp_path: Path) -> None:
    looking = robot(tmp_path, "looking", [device(BeaconReceiver)], body=BODY)
    between = robot(tmp_path, "between", at=(0.2, 0.0, 0.0), body='<geom type="box" size=".03 .03 .1" pos="0 0 .1"/>')
    shining = robot(tmp_path, "shining", [device(Beacon)], (0.4, 0.0, 0.0), body=BODY)
    assert seen(simulated(tmp_path, looking, between, shining)) == ()


def test_a_robot_does_not_see_its_own_beacon_and_a_label_takes_the_place_of_the_name(tmp_path: Path) -> None:
    looking = robot(tmp_path, "looking", [device(BeaconReceiver), device(Beacon, "own")], body=BODY)
    shining = robot(tmp_path, "shining", [device(Beacon, label="nest")], (0.4, 0.0, 0.0), body=BODY)
    assert [beacon.beacon for beacon in seen(simulated(tmp_path, looking, shining))] == ["nest"]


def test_a_beacon_that_fails_is_not_seen(tmp_path: Path) -> None:
    simulation = pair(tmp_path, (0.4, 0.0, 0.0))
    found(simulation, Beacon, of="shining").kit.failing = "silent"
    assert seen(simulation) == ()


def test_another_robot_changes_nobodys_noise(tmp_path: Path) -> None:
    looking = robot(tmp_path, "looking", [device(BeaconReceiver)], body=BODY)
    shining = robot(tmp_path, "shining", [device(Beacon)], (0.4, 0.0, 0.0), body=BODY)
    more = robot(tmp_path, "more", [device(Beacon)], (0.0, 0.4, 0.0), body=BODY)
    few, many = simulated(tmp_path, looking, shining), simulated(tmp_path, more, looking, shining)
    for _ in range(20):
        run(few)
        run(many)
        assert seen(few)[0] == next(beacon for beacon in seen(many) if beacon.beacon == "shining")


def test_each_failure_of_a_receiver_spoils_in_its_way(tmp_path: Path) -> None:
    simulation = pair(tmp_path, (0.4, 0.0, 0.0), **EXACT, bias=0.5, dropout=1.0)
    receiver = found(simulation, BeaconReceiver, of="looking")
    receiver.kit.failing = "bias"
    assert seen(simulation)[0].bearing == pytest.approx(0.5)
    receiver.kit.failing = "noise"
    assert seen(simulation)[0].bearing != 0.0
    receiver.kit.failing = "dropout"
    assert seen(simulation) == ()


@pytest.mark.parametrize("kind", [Beacon, BeaconReceiver])
def test_a_site_that_is_not_there_is_refused(tmp_path: Path, kind: type) -> None:
    with pytest.raises(SceneError, match="no site named 'beacon'"):
        simulated(tmp_path, robot(tmp_path, "", [device(kind)]))
