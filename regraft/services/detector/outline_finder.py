"""Finds hydrants by colour and outline: quick, but it wants light."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from regraft.services.detector.finder import Found, Picture
from regraft.services.detector.hydrant import Candidate, Thresholds, blobs, find_hydrant, red_masks
from regraft.services.detector.silhouette import Mask, likeness
from regraft.services.detector.view import View

MIN_SHOWN = 0.6
"""Share of a hydrant's height that must be in the picture: it is near enough then to be known by the rest."""


@dataclass(frozen=True, slots=True)
class OutlineFinder:
    """Looks for red areas with a hydrant's outline that stand on the floor.

    ``floor_tolerance`` is how far one may seem off the floor, as a share of its height.
    """

    thresholds: Thresholds
    floor_tolerance: float

    def find(self, pixels: Picture, view: View) -> tuple[Found, ...]:
        """Return what looks like a hydrant in a picture taken with this view, the likeliest first."""
        whole = (
            _found(pixels, candidate, view.depth(candidate), candidate.height)
            for candidate in find_hydrant(pixels, self.thresholds)
            if view.floor_error(candidate) <= self.floor_tolerance
        )
        return tuple(sorted((*whole, *self._too_near(pixels, view)), key=lambda found: -found.likeness))

    def _too_near(self, pixels: Picture, view: View) -> Iterator[Found]:
        """Yield the best that reaches beyond the upper edge: the place of its foot shows how far away it is."""
        best: Found | None = None
        for mask in red_masks(pixels, self.thresholds):
            for blob, left, top in blobs(mask, self.thresholds):
                bottom = top + blob.shape[0]
                if top > 0 or bottom == mask.shape[0]:
                    continue
                depth = view.depth_on_floor(bottom)
                height = view.shown_height(depth) if depth < np.inf else np.inf
                if not MIN_SHOWN * height <= bottom <= (1.0 + self.floor_tolerance) * height:
                    continue
                rows = max(round(height), bottom)
                score, axis = likeness(_completed(blob, rows), shown_from=rows - bottom)
                if score >= self.thresholds.score and (best is None or score > best.likeness):
                    best = _found(pixels, Candidate(score, left + axis, 0, bottom), depth, height)
        if best is not None:
            yield best


def _completed(blob: Mask, rows: int) -> Mask:
    """Return a mask with empty rows above it."""
    return np.vstack([np.zeros((rows - blob.shape[0], blob.shape[1]), np.bool_), blob])


def _found(pixels: Picture, candidate: Candidate, depth: float, height: float) -> Found:
    """Describe a candidate; its brightness is looked for where a hydrant is sure to be red, in the barrel."""
    half = max(1, candidate.height // 8)
    column = round(candidate.axis)
    barrel = pixels[candidate.top : candidate.bottom, max(0, column - half) : column + half, 0]
    brightness = float(cv2.mean(np.ascontiguousarray(barrel))[0]) / 255.0
    return Found(candidate.score, candidate.axis, depth, height, brightness)
