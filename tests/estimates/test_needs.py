"""The robot's parts say what they need, and estimates are numbers that fit it; measured: tests/evidence."""

from __future__ import annotations

import math

import pytest

from regraft import Component
from regraft.component.component import declared, describe
from regraft.component.parameters import ParameterSet
from regraft.services.battery import Battery
from regraft.services.charging.docking import Docking
from regraft.services.detector.detector import Detector
from regraft.services.detector.template_detector import TemplateDetector
from regraft.services.explorer.explorer import Explorer
from regraft.services.lighting import Lighting
from regraft.services.mapper.mapper import Mapper
from regraft.services.mapper.odometry_mapper import OdometryMapper
from regraft.services.navigator.navigator import Navigator
from regraft.services.navigator.pursuit_navigator import PursuitNavigator
from regraft.services.obstacles.obstacles import Obstacles
from regraft.services.sensor_monitor import SensorMonitor
from regraft.services.system_status import SystemStatusReporter
from regraft.sim_service.camera_component import Camera
from regraft.sim_service.map_server import MapServer
from regraft.sim_service.world import World

ESTIMATED: list[type[Component]] = [
    Battery,
    Camera,
    Detector,
    Docking,
    Explorer,
    Lighting,
    Mapper,
    Navigator,
    Obstacles,
    OdometryMapper,
    PursuitNavigator,
    SensorMonitor,
    TemplateDetector,
]
PARTS = [*ESTIMATED, MapServer, SystemStatusReporter, World]
SWAPPED = [(Navigator, PursuitNavigator), (Mapper, OdometryMapper), (Detector, TemplateDetector)]


def estimate(cls: type[Component], **context: object) -> dict[str, float]:
    """Estimate a class with its defaults, as ``regraft estimate`` does."""
    return cls.estimate(ParameterSet(declared(cls).parameters).plain(), dict(context))


@pytest.mark.parametrize("cls", PARTS, ids=lambda cls: cls.__name__)
def test_every_part_says_what_it_needs(cls: type[Component]) -> None:
    needs = describe(cls).resources
    assert 0.0 < needs.cpu < 1.0
    assert needs.memory > 0.0


@pytest.mark.parametrize("cls", ESTIMATED, ids=lambda cls: cls.__name__)
def test_every_part_estimates_what_it_gives_in_numbers_that_fit_its_needs(cls: type[Component]) -> None:
    qualities = estimate(cls)
    assert qualities
    assert all(math.isfinite(value) for value in qualities.values())
    assert qualities == cls.estimate({}, {}), "what is not said of the parameters is as by default"
    assert qualities.get("cpu", 0.0) <= describe(cls).resources.cpu


@pytest.mark.parametrize("pair", SWAPPED, ids=lambda pair: pair[0].__name__)
def test_parts_that_can_be_swapped_are_estimated_by_the_same_qualities(
    pair: tuple[type[Component], type[Component]],
) -> None:
    one, other = (estimate(cls, distance=3.0, darkness=0.5) for cls in pair)
    assert one.keys() == other.keys()
    assert one != other


def test_only_the_dock_is_held_by_one_alone() -> None:
    held = {cls.__name__: describe(cls).resources.devices for cls in PARTS}
    assert {name: devices for name, devices in held.items() if devices} == {"Docking": ("dock",)}
