"""Promises about light sensors."""

import math
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from regraft.sim_service.devices.light_sensor import LightSensor
from regraft.sim_service.layout.scene import SceneError
from regraft.sim_service.simulation import Simulation

from .worlds import FLOOR, device, found, robot, run, simulated

DARK = '<visual><headlight active="0" ambient="0 0 0"/></visual>'
LAMP = '<light type="point" pos="{} {} {}" diffuse="{} {} {}" ambient="0 0 0" attenuation="0 0 1"/>'
EXACT: dict[str, Any] = {"noise": 0.0, "resolution": 0.0}
TOP = 0.04
"""m at which the sensor is."""


def lit(folder: Path, lamps: str, *, extra: str = DARK, **parameters: Any) -> Simulation:
    """Return a robot that measures the light from above in a world with these lamps."""
    settings = {**EXACT, "site": "top", **parameters}
    return simulated(folder, robot(folder, "", [device(LightSensor, **settings)]), body=FLOOR + lamps, extra=extra)


def measured(simulation: Simulation) -> float:
    """Return what the sensor measures."""
    return found(simulation, LightSensor).measure().illuminance


@settings(max_examples=30, deadline=None)
@given(st.floats(-2, 2), st.floats(-2, 2), st.floats(0.3, 3), st.floats(0, 1))
def test_a_lamp_lights_by_the_inverse_square_and_the_cosine(x: float, y: float, z: float, level: float) -> None:
    with TemporaryDirectory() as folder:
        simulation = lit(Path(folder), LAMP.format(x, y, z, 1, 1, 1))
    simulation.set_light(level)
    distance = math.hypot(x, y, z - TOP)
    assert measured(simulation) == pytest.approx(500.0 * level * (z - TOP) / distance**3, rel=1e-4, abs=1e-6)


def test_lamps_add_up_by_their_colours_and_light_from_everywhere_too(tmp_path: Path) -> None:
    green, blue = LAMP.format(0, 0, 1 + TOP, 0, 1, 0), LAMP.format(0, 0, 2 + TOP, 0, 0, 1)
    assert measured(lit(tmp_path, green + blue)) == pytest.approx(500 * (0.7152 + 0.0722 / 4), rel=1e-4)
    ambient = '<visual><headlight ambient=".3 .3 .3"/></visual>'
    assert measured(lit(tmp_path, green, extra=ambient)) == pytest.approx(500 * (0.7152 + 0.3), rel=1e-4)


def test_a_body_between_shadows_a_lamp_and_its_own_robot_does_not(tmp_path: Path) -> None:
    lamp = LAMP.format(0, 0, 1, 1, 1, 1)
    shade = '<body name="shade" pos="{} 0 .5"><geom type="box" size=".1 .1 .01"/></body>'
    assert measured(lit(tmp_path, lamp + shade.format(0))) == 0.0
    assert measured(lit(tmp_path, lamp + shade.format(0.3))) > 400.0


def test_the_sun_shines_everywhere_alike_and_can_be_shadowed(tmp_path: Path) -> None:
    sun = '<light type="directional" pos="0 0 1" dir="0 1 -1" diffuse="1 1 1" ambient="0 0 0"/>'
    roof = '<body name="roof" pos="0 -1 1"><geom type="box" size=".1 .1 .1"/></body>'
    assert measured(lit(tmp_path, sun)) == pytest.approx(500 * math.sqrt(0.5), rel=1e-4)
    assert measured(lit(tmp_path, sun + roof)) == 0.0


def test_a_lamp_behind_the_sensor_does_not_light_it(tmp_path: Path) -> None:
    assert measured(lit(tmp_path, LAMP.format(-1, 0, 0.02, 1, 1, 1), site="front")) == 0.0


def test_it_shows_steps_up_to_its_maximum(tmp_path: Path) -> None:
    lamp = LAMP.format(0, 0, 1 + TOP, 1, 1, 1)
    assert measured(lit(tmp_path, lamp, resolution=30.0)) == 510.0
    assert measured(lit(tmp_path, lamp, maximum=100.0)) == 100.0


def test_failures_add_a_bias_or_noise(tmp_path: Path) -> None:
    simulation = lit(tmp_path, LAMP.format(0, 0, 1 + TOP, 1, 1, 1), bias=50.0)
    sensor = found(simulation, LightSensor)
    sensor.kit.failing = "bias"
    assert measured(simulation) == pytest.approx(550.0, rel=1e-4)
    sensor.kit.failing = "noise"
    values = set()
    for _ in range(5):
        run(simulation)
        values.add(measured(simulation))
    assert len(values) == 5


def test_measuring_does_not_disturb_the_physics(tmp_path: Path) -> None:
    measured_one, other = (lit(tmp_path, LAMP.format(0, 0, 1, 1, 1, 1)) for _ in range(2))
    for _ in range(5):
        run(measured_one)
        run(other)
        measured(measured_one)
    assert measured_one.digest() == other.digest()


def test_a_site_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"no site named 'eye'; there are: front, top"):
        lit(tmp_path, "", site="eye")
