"""The detector that compares with a template."""

from __future__ import annotations

from regraft import Parameter
from regraft.bus_schema.model.description import Resources
from regraft.services.detector.confidence import Calibration
from regraft.services.detector.finder import Finder
from regraft.services.detector.hydrant_detector import HydrantDetector
from regraft.services.detector.performance import Performance
from regraft.services.detector.template_finder import TemplateFinder
from regraft.services.power_model import PICTURE_ENERGY


class TemplateDetector(HydrantDetector):
    """Looks for a fire hydrant in pictures when asked, and reports where it is: good in the dark, but dearer.

    It compares every place on the floor where a hydrant could stand with a template of one. That takes more than twice
    the computing time, for which an on-board picture takes half as much energy again.
    """

    resources = Resources(cpu=0.07, memory=50.0)
    calibration = Calibration(constant=23.6, likeness=2.0, brightness=12.4, depth=-9.0)
    performance = Performance((1.0, 1.0, 0.99, 0.98, 0.98, 0.83, 0.65, 0.44, 0.09, 0.0), cpu=0.008)

    picture_energy = Parameter(1.5 * PICTURE_ENERGY, "for one on-board picture", minimum=0.0, unit="J")
    correlation = Parameter(0.68, "least correlation with the template", minimum=0.0, maximum=1.0)
    contrast = Parameter(
        25.0, "least redness above the surroundings, of 255, for each metre away up to 2 m", minimum=0.0, maximum=255.0
    )

    def finder(self) -> Finder:
        """Return what finds by comparing."""
        return TemplateFinder(self.correlation, self.contrast, self.farthest)
