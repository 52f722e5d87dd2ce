"""FROG's components, which publish no qualities where the environment says so: all else is the same on both sides."""

from __future__ import annotations

import os
from typing import ClassVar

from regraft.services import battery, lighting
from regraft.services.detector import detector
from regraft.services.navigator import navigator
from regraft.sim_service import camera_component, world

QUIET = "REGRAFT_BENCH_QUIET"


class Switched:
    """A mixin: measures nothing by itself where the variable is set."""

    evaluate_every: ClassVar[float | None] = None if os.environ.get(QUIET) else 1.0


class World(Switched, world.World):
    """The world."""


class Camera(Switched, camera_component.Camera):
    """Either camera."""


class Battery(Switched, battery.Battery):
    """The battery."""


class Lighting(Switched, lighting.Lighting):
    """The light."""


class Detector(Switched, detector.Detector):
    """The detector."""


class Navigator(Switched, navigator.Navigator):
    """The navigator."""
