"""What cameras, detectors, the light and the watch over the sensors are estimated to give, they give.

Detection rates by light are compared in tests/detector/test_curve.py and tests/evidence/sensing/test_detection.py.
"""

from __future__ import annotations

import pytest

from regraft import Component
from regraft.bus_schema.messages.health import SensorHealth
from regraft.bus_schema.messages.perception import Detect, Sightings
from regraft.bus_schema.messages.sensors import Image, LightLevel
from regraft.services.battery import Battery
from regraft.services.detector.detector import Detector
from regraft.services.detector.hydrant_detector import HydrantDetector
from regraft.services.detector.template_detector import TemplateDetector
from regraft.services.lighting import Lighting
from regraft.services.power_model import total_power
from regraft.services.sensor_monitor import SensorMonitor
from regraft.sim_service.camera_component import Camera
from regraft.testing import Rig
from tests.services.rigs import run, run_until, set_parameters, world_on
from tests.support.waiting import PATIENCE
from tests.support.worlds import FROG_WORLD

RAY = {**FROG_WORLD, "renderer": "ray", "width": 80, "height": 60}


class Asker(Component):
    """Asks the detector once."""

    async def _ask(self) -> None:
        begun = self.kit.now()
        self.sightings = await self.kit.call("detect", Detect(), Sightings, timeout=PATIENCE)
        self.seconds = self.kit.now() - begun

    def on_activate(self) -> None:
        self.seconds = 0.0
        self.kit.spawn(self._ask(), "ask")


@pytest.mark.parametrize("rate", [0.0, 4.0])
def test_pictures_come_at_the_rate_estimated_and_told(rate: float) -> None:
    parameters = {**RAY, "rate": rate}
    with Rig(seed=3) as rig:
        world = world_on(rig)
        camera = rig.add(Camera, parameters=parameters)
        run(rig, world, 1.0)
        assert camera.evaluate()["rate"] == 0.0
        images = rig.collect("image", Image)
        run(rig, world, 6.0)
        told = camera.evaluate()["rate"]
    estimate = Camera.estimate(parameters, {})["rate"]
    assert len(images) / 6.0 == pytest.approx(estimate, rel=0.1)
    assert told == pytest.approx(estimate, rel=0.1)


def test_a_camera_that_fails_is_told_to_give_no_pictures() -> None:
    with Rig(seed=3) as rig:
        world = world_on(rig)
        camera = rig.add(Camera, parameters={**RAY, "failures": [{"at": 2.0, "failure": "silent"}]})
        rig.collect("image", Image)
        run(rig, world, 8.0)
        assert camera.evaluate()["rate"] == 0.0


@pytest.mark.parametrize("kind", [Detector, TemplateDetector])
def test_a_request_takes_the_time_and_the_energy_estimated(kind: type[HydrantDetector]) -> None:
    parameters = {"pictures": 3, "interval": 0.7}
    with Rig(seed=3) as rig:
        world = world_on(rig)
        rig.add(Camera, parameters=RAY)
        rig.add(kind, "detector", parameters)
        battery = rig.add(Battery)
        run(rig, world, 1.0)
        drawn, begun = battery.evaluate()["drawn"], rig.clock.now()
        asker = rig.add(Asker)
        run_until(rig, world, lambda: asker.seconds > 0.0, within=20.0)
        run(rig, world, 0.5)
        standing = total_power(0.0) * (rig.clock.now() - begun) / 1e9
        spent = battery.evaluate()["drawn"] - drawn - standing
    estimate = kind.estimate(parameters, {"camera_rate": 2.0})
    assert asker.sightings.pictures == 3
    assert asker.seconds == pytest.approx(estimate["time_per_request"], abs=0.6)
    assert spent == pytest.approx(estimate["energy_per_request"], abs=total_power(0.0))
    assert estimate["power"] == pytest.approx(estimate["energy_per_request"] / estimate["time_per_request"])


@pytest.mark.parametrize("failure", ["silent", "frozen"])
def test_a_failing_lidar_is_told_within_the_time_estimated(failure: str) -> None:
    with Rig(seed=3) as rig:
        world = world_on(rig)
        rig.add(SensorMonitor)
        health = rig.collect("sensor_health", SensorHealth)
        run(rig, world, 3.3)
        assert not health[-1].faults
        set_parameters(rig, "world", scan_failure=failure)
        failed = rig.clock.now() / 1e9
        while not health[-1].faults:
            run(rig, world, 0.05)
            assert rig.clock.now() / 1e9 < failed + 10.0
        delay = rig.clock.now() / 1e9 - failed
    estimate = SensorMonitor.estimate({}, {"rate": 5.0})["detection_delay"]
    assert 0.4 * estimate <= delay <= estimate


def test_it_is_as_dark_as_estimated() -> None:
    with Rig() as rig:
        lighting = rig.add(Lighting, parameters={"period": 20.0})
        levels = rig.collect("light", LightLevel)
        rig.advance(20.0)
        for level in levels:
            told = Lighting.estimate({"period": 20.0}, {"time": level.stamp})["darkness"]
            assert level.darkness == pytest.approx(told)
        assert lighting.evaluate()["darkness"] == pytest.approx(levels[-1].darkness)
    mean = sum(level.darkness for level in levels) / len(levels)
    assert mean == pytest.approx(Lighting.estimate({"period": 20.0}, {})["darkness"], abs=0.01)
