"""FROG's components, which measure their qualities as often as the environment says: all else is the same."""

from __future__ import annotations

import os
from typing import ClassVar

from regraft import every
from regraft.services import battery, lighting
from regraft.services.detector import detector
from regraft.services.navigator import navigator
from regraft.sim_service import camera_component, world

OFTEN = 0.1
"""Seconds between two measurements, instead of the second between those of a component as it is."""
MEASURES, BEATS = "REGRAFT_BENCH_MEASURES", "REGRAFT_BENCH_BEATS"
"""The environment variables that have qualities measured often, and components called as often without that."""


class Switched:
    """A mixin: measures often, or never; called often either way, or not."""

    evaluate_every: ClassVar[float | None] = OFTEN if os.environ.get(MEASURES) else None

    if os.environ.get(BEATS):

        @every(seconds=OFTEN)
        def beat(self) -> None:
            """Do nothing, in as many steps as measurements take."""


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
