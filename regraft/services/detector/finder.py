"""The types of finders: pictures, and places in them that look like a hydrant."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from regraft.services.detector.view import View

Picture = NDArray[np.uint8]
"""RGB values (height, width, 3), row 0 at the top."""


@dataclass(frozen=True, slots=True)
class Found:
    """Something in a picture that looks like a hydrant standing on the floor.

    ``likeness`` from 0 to 1 is how well its shape fits, in the finder's own measure; ``axis`` is the column (px, from
    the left edge) of its axis; ``depth`` how far (m) ahead its axis is; ``height`` how many rows (px) it has, those
    beyond the picture's upper edge included; ``brightness`` from 0 to 1 is the mean red of its pixels.
    """

    likeness: float
    axis: float
    depth: float
    height: float
    brightness: float


class Finder(Protocol):
    """Finds hydrants in single pictures. The same picture always gives the same answer."""

    def find(self, pixels: Picture, view: View) -> tuple[Found, ...]:
        """Return what looks like a hydrant in a picture taken with this view, the likeliest first."""
