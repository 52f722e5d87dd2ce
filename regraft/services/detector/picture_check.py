"""Whether a picture is worth looking at."""

from __future__ import annotations

import numpy as np

from regraft.bus_schema.messages.sensors import Image
from regraft.services.sensor_checks import FROZEN, Finding, judge_picture, picture_fingerprint


def fault_of(image: Image, before: Image | None) -> Finding | None:
    """Report what is wrong with a picture, given the one before it, if there was one; None if it is of use.

    A working sensor's noise makes any two pictures differ, even of nothing in the dark.
    """
    finding = judge_picture(picture_fingerprint(image.pixels))
    if finding is not None:
        return finding
    if before is not None and before.stamp != image.stamp and np.array_equal(before.pixels, image.pixels):
        again = f"that of {image.stamp:.1f} s is the one of {before.stamp:.1f} s again"
        return Finding(FROZEN, f"the pictures are frozen: {again}")
    return None
