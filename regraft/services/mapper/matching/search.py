"""Correlative search: where, of many poses, a scan fits the map best.

E. Olson: Real-time correlative scan matching. ICRA 2009; here with one coarse level, refined by the matcher.
"""

from __future__ import annotations

import math

import numpy as np

from regraft.planar import FloatArray, Pose2D, wrap_angle
from regraft.services.mapper.maps.grid import UNKNOWN, Window
from regraft.services.mapper.matching.field import Field
from regraft.services.mapper.matching.matcher import Match, Prior, match
from regraft.services.mapper.matching.surface import Surface

MAX_ECHOES = 60
"""Echoes that are looked at, evenly chosen."""
APART = 0.5
"""m between places that are looked at further as different ones."""
CANDIDATES = 5
NEAR_BLUR, NEAR_TURN_STEP = 0.07, 0.06
FAR_BLUR, FAR_STEP, FAR_TURN_STEP = 0.12, 0.1, math.radians(5)
"""m, m and rad: how coarsely the whole map is searched."""
LOOSE = Prior(0.3, 0.3)
UNLIKE = 0.04
"""Share of the echoes by which the best place must fit better than any other: rooms are often nearly symmetric."""


def search_near(
    surface: Surface, window: Window, echoes: FloatArray, guess: Pose2D, reach: float, turn: float
) -> Match | None:
    """Return the best match within ``reach`` (m, each axis) and ``turn`` (rad) of a guess, None without a map.

    ``window`` is the part of the map around the guess. Where the echoes do not constrain the match, it is as far as
    the guess.
    """
    if not len(echoes) or not len(surface.points):
        return None
    field = Field.of(window, NEAR_BLUR)
    count = max(1, round(reach / field.resolution))
    x, y = np.meshgrid(*(centre + np.linspace(-reach, reach, 2 * count + 1) for centre in (guess.x, guess.y)))
    half = max(1, round(turn / NEAR_TURN_STEP))
    headings = guess.yaw + np.linspace(-turn, turn, 2 * half + 1)
    best = candidates(field, echoes, np.column_stack([x.ravel(), y.ravel()]), headings, 1)[0]
    return match(surface, echoes, guess, LOOSE, start=best)


def search_everywhere(window: Window, echoes: FloatArray) -> Match | None:
    """Return the only match, of all places on the known free ground of a map; None if several are as good."""
    surface = Surface.of(window)
    places = _free_places(window)
    if not len(echoes) or not len(surface.points) or not len(places):
        return None
    headings = np.arange(-math.pi, math.pi, FAR_TURN_STEP)
    found = candidates(Field.of(window, FAR_BLUR), echoes, places, headings, CANDIDATES)
    matches = sorted((match(surface, echoes, pose, LOOSE) for pose in found), key=lambda m: -m.inliers)
    best = matches[0]
    for other in matches[1:]:
        if best.pose.distance(other.pose) > APART and other.inliers > best.inliers * (1.0 - UNLIKE):
            return None
    return best


def candidates(field: Field, echoes: FloatArray, places: FloatArray, headings: FloatArray, most: int) -> list[Pose2D]:
    """Return at most so many of the best poses, ``APART``, of all ``places`` (m, 2; m) with all ``headings`` (rad)."""
    chosen = echoes[:: math.ceil(len(echoes) / MAX_ECHOES)]
    scores = np.empty((len(headings), len(places)), np.float32)
    for number, heading in enumerate(headings):
        turned = Pose2D(yaw=float(heading)).outward(chosen)
        scores[number] = field.at(places[:, :1] + turned[:, 0], places[:, 1:] + turned[:, 1]).mean(axis=1)
    best_headings, best_scores = scores.argmax(axis=0), scores.max(axis=0)
    found: list[Pose2D] = []
    while len(found) < most and best_scores.max() >= 0.0:
        place = int(best_scores.argmax())
        x, y = places[place].tolist()
        found.append(Pose2D(x, y, wrap_angle(float(headings[best_headings[place]]))))
        best_scores[np.hypot(places[:, 0] - x, places[:, 1] - y) <= APART] = -1.0
    return found


def _free_places(window: Window) -> FloatArray:
    step = max(1, round(FAR_STEP / window.resolution))
    rows, columns = np.nonzero(window.cells[::step, ::step] < UNKNOWN)
    corner = np.array([window.x, window.y])
    return np.asarray(corner + (np.column_stack([columns, rows]) * step + 0.5) * window.resolution)
