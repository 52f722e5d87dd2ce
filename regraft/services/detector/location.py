"""Where something stands, from several sightings of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from regraft.bus_schema.messages.geometry import Vector3
from regraft.bus_schema.messages.perception import Detection

MAP_FRAME = "map"
NEAREST = 0.1
"""m: nearer sightings weigh no more."""

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Location:
    """A position (m) in a frame; ``spread`` (m) is the median distance of the sightings from it, None for one."""

    frame: str
    position: Vector3
    spread: float | None


def locate(sightings: Sequence[Detection]) -> Location | None:
    """Return where it is by the sightings, None without any.

    It is the median of each coordinate, weighted by confidence / distance: a far sighting errs more, and one that is
    wrong altogether counts for one. Only sightings in one frame can be compared: those in the map, if there are any.
    """
    if not sightings:
        return None
    frame = MAP_FRAME if any(seen.frame == MAP_FRAME for seen in sightings) else sightings[-1].frame
    chosen = [seen for seen in sightings if seen.frame == frame]
    places = np.array([(seen.position.x, seen.position.y) for seen in chosen])
    weights = np.array([max(seen.confidence, 1e-6) / max(seen.distance, NEAREST) for seen in chosen])
    x, y = weighted_median(places[:, 0], weights), weighted_median(places[:, 1], weights)
    distances = np.hypot(places[:, 0] - x, places[:, 1] - y)
    spread = float(np.median(distances)) if len(chosen) > 1 else None
    return Location(frame, Vector3(x, y, 0.0), spread)


def weighted_median(values: Floats, weights: Floats) -> float:
    """Return the least value up to which half of the weight lies; the middle of two if it lies between them."""
    order = np.argsort(values, kind="stable")
    ordered, reached = values[order], np.cumsum(weights[order])
    half = reached[-1] / 2.0
    first = int(np.searchsorted(reached, half * (1.0 - 1e-12)))
    if abs(reached[first] - half) <= half * 1e-12 and first + 1 < len(ordered):
        return float((ordered[first] + ordered[first + 1]) / 2.0)
    return float(ordered[first])
