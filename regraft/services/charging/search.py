"""Where to look for a dock that is not felt where it should be."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

from regraft.bus_schema.messages.geometry import Pose

DIRECTIONS = (0.0, math.pi, math.pi / 2, -math.pi / 2)
"""Seen from the dock, in which order it is tried next to its place: ahead, behind, left, right."""


def places_to_try(dock: Pose, distance: float) -> Iterator[Pose]:
    """Yield the dock's own pose, then others at ``distance`` (m) around it, as much farther out at each round."""
    yield dock
    for around in itertools.count(1):
        for direction in DIRECTIONS:
            heading, reach = dock.yaw + direction, distance * around
            yield Pose.planar(dock.x + reach * math.cos(heading), dock.y + reach * math.sin(heading), dock.yaw)
