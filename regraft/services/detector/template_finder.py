"""Finds hydrants by comparing with a template at every place on the floor: thorough, dearer, and good in the dark."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from regraft.services.detector.finder import Found, Picture
from regraft.services.detector.silhouette import HEIGHT, half_widths
from regraft.services.detector.view import View

Floats = NDArray[np.float32]

ROWS = 24
"""How many rows a hydrant is scaled to: enough to distinguish its parts, few enough to average noise away."""
MARGIN = 4
"""Rows above and below, and columns aside, of the template that must not be red."""
NEAREST = 0.35
"""m"""
STEP = 1.06
"""Ratio of one depth that is tried to the one before."""
MIN_SHOWN = 0.6
"""Share of a hydrant's height that must be in the picture."""
INSIDE, OUTSIDE = 200, 20
"""Values of the template above which it is surely a hydrant, and below which surely none."""
EVEN = 0.45
"""Least evenness of a hydrant: something lower leaves the upper third empty, though the rest fits."""
FAR = 2.0
"""m, up to which the contrast that is wanted grows with the distance: a smaller picture proves less."""
MOST = 3
"""How many places of a picture are returned at the most."""


@dataclass(frozen=True, slots=True)
class TemplateFinder:
    """Slides the hydrant's silhouette over the floor, wherever it could stand, and correlates it with what is red.

    Every depth has one row for the foot and one size, so that only columns are searched. ``least`` is the least
    correlation (0 to 1). ``contrast`` is the least redness above the surroundings (0 to 255) for each metre away.
    ``farthest`` is how far (m) is searched.
    """

    least: float
    contrast: float
    farthest: float

    def find(self, pixels: Picture, view: View) -> tuple[Found, ...]:
        """Return what looks like a hydrant in a picture taken with this view, the likeliest first."""
        red = redness(pixels)
        found = [found for depth in self._depths() for found in self._along(red, view, depth)]
        best: list[Found] = []
        for one in sorted(found, key=lambda found: -found.likeness):
            if len(best) < MOST and not any(_overlap(one, other) for other in best):
                best.append(one)
        return tuple(best)

    def _depths(self) -> Iterator[float]:
        depth = NEAREST
        while depth <= self.farthest:
            yield depth
            depth *= STEP

    def _along(self, red: Picture, view: View, depth: float) -> Iterator[Found]:
        """Yield the best place for a hydrant at one depth, if there is any."""
        height, foot = view.shown_height(depth), view.foot_row(depth)
        scale = ROWS / height
        first = max(0, round(foot - height))
        last = round(foot)
        hidden = max(0, round(-(foot - height) * scale))
        if last > red.shape[0] or hidden > (1.0 - MIN_SHOWN) * ROWS or last - first < 3:
            return
        edge = round(MARGIN / scale)
        above = 0 if hidden else min(edge, first)
        below = min(edge, red.shape[0] - last)
        strip = red[first - above : last + below]
        rows = (ROWS - hidden, round(above * scale), round(below * scale))
        size = (max(1, round(red.shape[1] * scale)), sum(rows))
        how = cv2.INTER_AREA if scale < 1.0 else cv2.INTER_LINEAR
        narrow = cv2.resize(strip, size, interpolation=how)
        bordered = cv2.copyMakeBorder(narrow, 0, 0, MARGIN, MARGIN, cv2.BORDER_CONSTANT, value=(0.0,))
        scaled = np.asarray(bordered, np.uint8)
        template = _template(hidden, rows[1], rows[2])
        if scaled.shape[1] < template.shape[1]:
            return
        response = cv2.matchTemplate(scaled, template, cv2.TM_CCOEFF_NORMED)
        column = int(response[0].argmax())
        correlation = float(response[0, column])
        if correlation < self.least:
            return
        window = scaled[:, column : column + template.shape[1]]
        contrast = _contrast(window, template)
        evenness = _evenness(window[rows[1] :], rows[0], template[rows[1] :])
        if contrast < self.contrast * min(depth, FAR) or evenness < EVEN:
            return
        axis = (column + template.shape[1] / 2.0 - MARGIN) / scale
        yield Found(min(1.0, correlation), axis, depth, height, contrast / 255.0)


def redness(pixels: Picture) -> Picture:
    """Return how red each pixel is (0 to 255): red without twice the rest, so that neither grey nor orange is."""
    red, green, blue = cv2.split(pixels)
    rest = cv2.max(green, blue)
    return np.asarray(cv2.subtract(red, cv2.add(rest, rest)), np.uint8)


def _overlap(one: Found, other: Found) -> bool:
    return abs(one.axis - other.axis) <= 0.3 * max(one.height, other.height)


def _contrast(window: Picture, template: Picture) -> float:
    """Return how much redder (0 to 255) the silhouette's inside is than its surroundings."""
    return float(window[template > INSIDE].mean()) - float(window[template < OUTSIDE].mean())


def _evenness(window: Picture, rows: int, template: Picture) -> float:
    """Return the redness of the least red third of the silhouette's rows, as a share of the reddest."""
    thirds = [slice(rows * n // 3, rows * (n + 1) // 3) for n in range(3)]
    means = [float(window[third][template[third] > INSIDE].mean()) for third in thirds]
    return min(means) / max(*means, 1.0)


@cache
def _template(hidden: int, above: int, below: int) -> Picture:
    """Return the silhouette (255 where always red), its ``hidden`` top rows left out, with margins (rows)."""
    metres = HEIGHT / ROWS
    fine = 4
    heights = HEIGHT - (np.arange(ROWS * fine) + 0.5) * metres / fine
    least, most = half_widths(heights)
    half = math.ceil(float(most.max()) / metres) + MARGIN
    aside = np.abs((np.arange(2 * half * fine) + 0.5) / fine - half) * metres
    sure = aside[None, :] < least[:, None]
    perhaps = aside[None, :] < most[:, None]
    shares = (0.5 * sure + 0.5 * perhaps).reshape(ROWS, fine, 2 * half, fine).mean(axis=(1, 3))
    padded = np.pad(shares[hidden:], ((above, below), (0, 0)))
    return np.asarray(np.rint(padded * 255.0), np.uint8)
