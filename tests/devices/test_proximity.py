"""Promises about rings of infrared sensors."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from regraft.sim_service.devices.proximity import ProximityRing
from regraft.sim_service.layout.scene import SceneError
from regraft.sim_service.simulation import Simulation

from .worlds import FLOOR, PUCK, device, found, robot, run, simulated

ANGLES = (10, 45, 90, 150, 210, 270, 315, 350)
RING = PUCK + "".join(
    f'<site name="ir{i}" pos="{0.035 * math.cos(math.radians(a))} {0.035 * math.sin(math.radians(a))} .02"'
    f' euler="0 0 {a}"/>'
    for i, a in enumerate(ANGLES)
)
EXACT: dict[str, Any] = {"noise": 0.0, "opening": 0.0, "rays": 1}


def beside_a_wall(folder: Path, gap: float, yaw: float = 0.0, **parameters: Any) -> Simulation:
    """Return a robot whose hull is as far (m) from a wall in front of it as ``gap`` says."""
    wall = f'{FLOOR}<body name="wall" pos="{0.035 + gap + 0.05} 0 .2"><geom type="box" size=".05 1 .2"/></body>'
    puck = robot(folder, "", [device(ProximityRing, **parameters)], (0.0, 0.0, yaw), body=RING)
    simulation = simulated(folder, puck, body=wall)
    run(simulation)
    return simulation


@pytest.mark.parametrize("yaw", [0.0, 0.4, -1.2])
def test_distances_to_a_wall_are_those_of_geometry(tmp_path: Path, yaw: float) -> None:
    simulation = beside_a_wall(tmp_path, 0.03, yaw, **EXACT)
    measured = found(simulation, ProximityRing).measure()
    for angle, bearing, distance in zip(ANGLES, measured.bearings, measured.distances, strict=True):
        assert math.remainder(math.radians(angle) - float(bearing), 2.0 * math.pi) == pytest.approx(0.0, abs=1e-6)
        cosine = math.cos(math.radians(angle) + yaw)
        expected = (0.065 - 0.035 * cosine) / cosine if cosine > 0.0 else math.inf
        assert distance == pytest.approx(expected if expected <= 0.06 else math.inf, abs=1e-6)


def test_nothing_beyond_its_reach_is_measured(tmp_path: Path) -> None:
    assert np.isinf(found(beside_a_wall(tmp_path, 0.0601, **EXACT), ProximityRing).distances()).all()


def test_a_wide_sensor_sees_what_a_narrow_one_misses(tmp_path: Path) -> None:
    post = f'{FLOOR}<body name="post" pos=".075 .02 .1"><geom type="cylinder" size=".005 .1"/></body>'
    body = PUCK + '<site name="ir" pos=".035 0 .02"/>'
    for opening, seen in ((0.0, False), (1.0, True)):
        puck = robot(tmp_path, "", [device(ProximityRing, sites="ir", opening=opening, rays=9)], body=body)
        assert np.isfinite(found(simulated(tmp_path, puck, body=post), ProximityRing).distances()).all() == seen


def test_it_sees_other_robots(tmp_path: Path) -> None:
    watching = robot(tmp_path, "one", [device(ProximityRing, sites="front", **EXACT)])
    other = robot(tmp_path, "two", at=(0.09, 0.0, 0.0))
    simulation = simulated(tmp_path, watching, other)
    assert found(simulation, ProximityRing, of="one").distances() == pytest.approx([0.02])


def test_noise_has_its_size_and_is_the_same_whatever_other_robots_there_are(tmp_path: Path) -> None:
    watching = robot(tmp_path, "one", [device(ProximityRing, sites="front", noise=0.002)])
    far = robot(tmp_path, "aaa", [device(ProximityRing, sites="front")], at=(2.0, 0.0, 0.0))
    near = '<body name="wall" pos=".115 0 .2"><geom type="box" size=".05 1 .2"/></body>'
    alone, crowded = (
        simulated(tmp_path, watching, body=FLOOR + near),
        simulated(tmp_path, far, watching, body=FLOOR + near),
    )
    values = []
    for _ in range(300):
        first, second = (found(world, ProximityRing, of="one").measure().distances for world in (alone, crowded))
        np.testing.assert_array_equal(first, second)
        values.append(float(first[0]))
        run(alone)
        run(crowded)
    assert np.mean(values) == pytest.approx(0.03, abs=0.0005)
    assert np.std(values) == pytest.approx(0.002, rel=0.15)


def test_each_failure_spoils_the_distances_in_its_way(tmp_path: Path) -> None:
    simulation = beside_a_wall(tmp_path, 0.03, **EXACT, bias=0.01, dropout=1.0, more_noise=0.005)
    ring = found(simulation, ProximityRing)
    right = ring.measure().distances
    ring.kit.failing = "bias"
    np.testing.assert_allclose(ring.measure().distances, np.where(right < 0.06, np.minimum(right + 0.01, 0.06), np.inf))
    ring.kit.failing = "dropout"
    assert np.isinf(ring.measure().distances).all()
    ring.kit.failing = "noise"
    assert (ring.measure().distances[np.isfinite(right)] != right[np.isfinite(right)]).all()


@pytest.mark.parametrize(
    ("sites", "complaint"), [("front ir9", "no site named 'ir9'"), (" ", "at least one MJCF site")]
)
def test_sites_that_are_not_there_are_refused(tmp_path: Path, sites: str, complaint: str) -> None:
    with pytest.raises(SceneError, match=complaint):
        simulated(tmp_path, robot(tmp_path, "", [device(ProximityRing, sites=sites)]))
