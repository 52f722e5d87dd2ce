"""How firmly something is seen: a number that means something."""

from __future__ import annotations

import math
from dataclasses import dataclass

from regraft.services.detector.finder import Found


@dataclass(frozen=True, slots=True)
class Calibration:
    """A logistic model of confidence, fitted for one finder.

    Confidence is the chance that a picture from there in a tenth less light would show the hydrant too. The chance of
    its being a hydrant would always be near 1: false sightings are rare (below 1 %). The weights are those of the
    likeness and of the logarithms of brightness and depth (m).
    """

    constant: float
    likeness: float
    brightness: float
    depth: float

    def confidence(self, found: Found) -> float:
        """Return the confidence, from 0 to 1: more light, a nearer place and a better shape raise it."""
        evidence = (
            self.constant
            + self.likeness * found.likeness
            + self.brightness * math.log(max(found.brightness, 1e-3))
            + self.depth * math.log(max(found.depth, 1e-3))
        )
        return 1.0 / (1.0 + math.exp(-max(-50.0, min(50.0, evidence))))
