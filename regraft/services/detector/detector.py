"""The detector that looks for colour and outline."""

from __future__ import annotations

from regraft import Parameter
from regraft.bus_schema.model.description import Resources
from regraft.services.detector.confidence import Calibration
from regraft.services.detector.finder import Finder
from regraft.services.detector.hydrant import Thresholds
from regraft.services.detector.hydrant_detector import HydrantDetector
from regraft.services.detector.outline_finder import OutlineFinder
from regraft.services.detector.performance import Performance

NEAR_ENOUGH = 0.08
"""How far a hydrant may seem off the floor, as a share of its height: rendered ones were at most 0.06 off."""


class Detector(HydrantDetector):
    """Looks for a fire hydrant in pictures when asked, and reports where it is: quick, but it wants light.

    It takes red areas for hydrants that have a hydrant's outline. Each on-board picture takes 59.275 J.
    """

    resources = Resources(cpu=0.03, memory=50.0)
    calibration = Calibration(constant=-9.8, likeness=23.1, brightness=8.3, depth=-0.6)
    performance = Performance((0.99, 0.96, 0.87, 0.60, 0.47, 0.20, 0.02, 0.0, 0.0, 0.0), cpu=0.003)

    saturation = Parameter(110, "least saturation of a hydrant's pixel", minimum=0, maximum=255)
    brightness = Parameter(57, "least brightness of a hydrant's pixel", minimum=0, maximum=255)
    score = Parameter(0.75, "least likeness to a hydrant's outline", minimum=0.0, maximum=1.0)

    def finder(self) -> Finder:
        """Return what finds by colour and outline."""
        return OutlineFinder(Thresholds(self.saturation, self.brightness, score=self.score), NEAR_ENOUGH)
