"""The outline of a fire hydrant from the side."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

HEIGHT = 0.361
"""m, from the floor to the top of the nut."""
FOOT_RADIUS = 0.085
"""m"""

# Height (m) up to which a part reaches, and the half widths (m) seen at least and at most. The caps for the hoses stick
# out to the side, by how the hydrant is turned.
PARTS = (
    (0.024, 0.085, 0.085),
    (0.138, 0.062, 0.062),
    (0.225, 0.062, 0.104),
    (0.250, 0.062, 0.062),
    (0.276, 0.078, 0.078),
    (0.300, 0.057, 0.064),
    (0.318, 0.045, 0.057),
    (0.332, 0.024, 0.045),
    (HEIGHT, 0.018, 0.018),
)
TOP = 0.93
"""Share of the height above which there is only the nut."""


def half_widths(heights: Floats) -> tuple[Floats, Floats]:
    """Return the half widths (m) that are seen at least and at most at heights (m) above the floor."""
    tops = np.array([top for top, _, _ in PARTS])
    part = np.minimum(np.searchsorted(tops, heights), len(PARTS) - 1)
    return np.array([least for _, least, _ in PARTS])[part], np.array([most for _, _, most in PARTS])[part]


def likeness(mask: Mask, shown_from: int = 0) -> tuple[float, float]:
    """Return how much a mask (rows, columns), cut to its outline, looks like a hydrant that stands upright.

    Returns the likeness, from 0 to 1, and the column of the hydrant's axis. The likeness is one minus the share of the
    hydrant's area that is missing or too much. Half a pixel at the edges is forgiven. Rows above ``shown_from`` are
    outside the picture and not judged.
    """
    rows, columns = mask.shape
    axis = _axis(mask[shown_from:])
    metres = HEIGHT / rows
    heights = HEIGHT - (np.arange(rows) + 0.5) * metres
    aside = np.abs(np.arange(columns) + 0.5 - axis) * metres
    least, most = half_widths(heights)
    least[:shown_from] = 0.0
    inside = aside[None, :] < least[:, None]
    missing = ~mask & (aside[None, :] < (least - metres)[:, None])
    too_much = mask & (aside[None, :] > (most + metres)[:, None])
    area = 2.0 * float(least.sum()) / metres
    wrong = int(missing.sum()) + int(too_much.sum())
    cut_off = max(0.0, area - float(inside.sum()) - rows)
    return max(0.0, 1.0 - (wrong + cut_off) / area), axis


def narrows(mask: Mask) -> float:
    """Return the width of a mask's topmost rows, as a share of its typical width; 1 for a box."""
    widths = mask.sum(axis=1)
    top = max(1, round((1.0 - TOP) * len(widths)))
    return float(widths[:top].mean() / np.median(widths))


def _axis(mask: Mask) -> float:
    """Return the column (px) of the axis: the median of the rows' middles; caps stick out in some."""
    first = mask.argmax(axis=1)
    last = mask.shape[1] - mask[:, ::-1].argmax(axis=1)
    filled = mask.any(axis=1)
    return float(np.median((first + last)[filled]) / 2.0)
