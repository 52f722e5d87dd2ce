"""FROG's components, as they would be if they published no qualities."""

from __future__ import annotations

from typing import ClassVar

from regraft.services import battery, lighting
from regraft.services.detector import detector
from regraft.services.navigator import navigator
from regraft.sim_service import camera_component, world


class Quiet:
    """A mixin: measures nothing by itself."""

    evaluate_every: ClassVar[float | None] = None


class World(Quiet, world.World):
    """The world."""


class Camera(Quiet, camera_component.Camera):
    """Either camera."""


class Battery(Quiet, battery.Battery):
    """The battery."""


class Lighting(Quiet, lighting.Lighting):
    """The light."""


class Detector(Quiet, detector.Detector):
    """The detector."""


class Navigator(Quiet, navigator.Navigator):
    """The navigator."""
