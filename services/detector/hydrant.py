"""Finds red hydrants in pictures, by colour and shape."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from services.detector.silhouette import Mask, likeness, narrows

Image = NDArray[np.uint8]

REDDEST, WIDEST_RED = 8, 172
"""OpenCV's hues (0 to 179) below and above which a pixel is red; orange begins above 10."""


@dataclass(frozen=True, slots=True)
class Thresholds:
    """What counts as a hydrant: saturation and brightness (0 to 255) of its pixels, its height (px), its shape."""

    saturation: int = 110
    value: int = 45
    height: int = 10
    score: float = 0.75
    narrowing: float = 0.75


@dataclass(frozen=True, slots=True)
class Candidate:
    """Something red in a picture.

    ``score`` from 0 to 1 is how much it looks like a hydrant; ``axis`` is the column (px, from the left edge) of its
    axis, ``top`` and ``bottom`` are the rows (px, from the upper edge) that bound it; ``cut`` tells that it reaches
    the edge of the picture.
    """

    score: float
    axis: float
    top: int
    bottom: int
    cut: bool

    @property
    def height(self) -> int:
        """The height in pixels."""
        return self.bottom - self.top


def find_hydrant(image: Image, thresholds: Thresholds | None = None) -> tuple[Candidate, ...]:
    """Return what looks like a hydrant in an RGB picture (height, width, 3), the best first; none in the dark."""
    wanted = thresholds or Thresholds()
    mask = _red(image, wanted)
    count, labels, boxes, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    found = []
    for label in range(1, count):
        left, top, width, height = (int(boxes[label, i]) for i in range(4))
        if height < wanted.height or width < 3:
            continue
        blob: Mask = labels[top : top + height, left : left + width] == label
        score, axis = likeness(blob)
        if score < wanted.score or narrows(blob) > wanted.narrowing:
            continue
        cut = top == 0 or left == 0 or top + height == image.shape[0] or left + width == image.shape[1]
        found.append(Candidate(score, left + axis, top, top + height, cut))
    return tuple(sorted(found, key=lambda candidate: -candidate.score))


def _red(image: Image, wanted: Thresholds) -> Image:
    """Return where the picture is red (255), small holes and specks removed."""
    hsv = cv2.cvtColor(image, cv2.COLOR_RGB2HSV)
    bright = (wanted.saturation, wanted.value)
    low = cv2.inRange(hsv, (0, *bright), (REDDEST - 1, 255, 255))
    high = cv2.inRange(hsv, (WIDEST_RED + 1, *bright), (180, 255, 255))
    mask = cv2.bitwise_or(low, high)
    return np.asarray(cv2.morphologyEx(mask, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8)), np.uint8)
