"""Finds red hydrants in pictures, by colour and shape."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from regraft.services.detector.silhouette import Mask, likeness, narrows

Image = NDArray[np.uint8]

REDDEST, WIDEST_RED = 8, 172
"""OpenCV's hues (0 to 179) below and above which a pixel is red; orange begins above 10."""


@dataclass(frozen=True, slots=True)
class Thresholds:
    """The thresholds of a hydrant: saturation and brightness (0 to 255) of its pixels, height (px), shape."""

    saturation: int = 110
    value: int = 57
    height: int = 8
    score: float = 0.75
    narrowing: float = 0.75


@dataclass(frozen=True, slots=True)
class Candidate:
    """Something red in a picture.

    ``score`` from 0 to 1 is how much it looks like a hydrant. ``axis`` is the column (px, from the left edge) of its
    axis. ``top`` and ``bottom`` are the rows (px, from the upper edge) that bound it.
    """

    score: float
    axis: float
    top: int
    bottom: int

    @property
    def height(self) -> int:
        """The height in pixels."""
        return self.bottom - self.top

    def overlaps(self, other: Candidate) -> bool:
        """Return whether two candidates are in the same place."""
        rows = self.top < other.bottom and other.top < self.bottom
        return rows and abs(self.axis - other.axis) < 0.3 * max(self.height, other.height)


def find_hydrant(image: Image, thresholds: Thresholds | None = None) -> tuple[Candidate, ...]:
    """Return what looks like a hydrant in an RGB picture (height, width, 3), the best first.

    A shape that reaches the upper or lower edge is left out: its height, and so its distance, are unknown.
    """
    wanted = thresholds or Thresholds()
    found = [candidate for mask in red_masks(image, wanted) for candidate in _candidates(mask, wanted)]
    best: list[Candidate] = []
    for candidate in sorted(found, key=lambda candidate: -candidate.score):
        if not any(candidate.overlaps(other) for other in best):
            best.append(candidate)
    return tuple(best)


def red_masks(image: Image, wanted: Thresholds) -> tuple[Image, Image]:
    """Return where the picture is red (255), as it is and with holes closed.

    Noise leaves holes in a dim hydrant; closing them may join it to something red next to it. So both are tried.
    """
    red = _red(image, wanted)
    return red, np.asarray(cv2.morphologyEx(red, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8)), np.uint8)


def blobs(mask: Image, wanted: Thresholds) -> Iterator[tuple[Mask, int, int]]:
    """Yield each connected area that is large enough, cut to its outline, with its first column and row."""
    count, labels, boxes, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    for label in range(1, count):
        left, top, width, height = (int(boxes[label, i]) for i in range(4))
        if height >= wanted.height and width >= 3:
            yield labels[top : top + height, left : left + width] == label, left, top


def _candidates(mask: Image, wanted: Thresholds) -> Iterator[Candidate]:
    for blob, left, top in blobs(mask, wanted):
        height = blob.shape[0]
        if top == 0 or top + height == mask.shape[0]:
            continue
        score, axis = likeness(blob)
        if score >= wanted.score and narrows(blob) <= wanted.narrowing:
            yield Candidate(score, left + axis, top, top + height)


def _red(image: Image, wanted: Thresholds) -> Image:
    """Return where the picture is red (255)."""
    hsv = cv2.cvtColor(image, cv2.COLOR_RGB2HSV)
    bright = (wanted.saturation, wanted.value)
    low = cv2.inRange(hsv, (0, *bright), (REDDEST - 1, 255, 255))
    high = cv2.inRange(hsv, (WIDEST_RED + 1, *bright), (180, 255, 255))
    return np.asarray(cv2.bitwise_or(low, high), np.uint8)
