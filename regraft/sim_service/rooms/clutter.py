"""Drawing boxes that make one stretch of a corridor narrow."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from regraft.sim_service.rooms.blocks import Block, NoRoom, distance_between, distance_to_blocks
from regraft.sim_service.rooms.corridor_rule import MIN_BOX, CorridorRule
from regraft.sim_service.rooms.ring import Corridor, Ring

FROM_CORNER: Final = 0.5
"""m between a box and the end of the core."""
FROM_PLACE: Final = 1.0
"""m between a box and a place to visit, from which robots look at it."""
GAP: Final = (0.6, 1.1)
"""m along the corridor from box to box, which are on alternating sides."""
SHORTER: Final = 0.1
"""m, at most, by which a box ends before the free passage."""
STEP: Final = 0.1
"""m by which a box is moved that found no place."""
DRAWS: Final = 20
"""Draws of where the stretch begins."""


def draw_clutter(
    rule: CorridorRule,
    random: np.random.Generator,
    ring: Ring,
    places: Sequence[Block],
    site: tuple[float, float] | None,
) -> tuple[Block, ...]:
    """Draw boxes along the walls of one corridor; the passage around its middle line stays free.

    Raises:
        NoRoom: the corridor that was drawn is too short for the boxes.
    """
    count = int(random.integers(rule.clutter[0], rule.clutter[1] + 1))
    corridor = ring.corridors[int(random.integers(len(ring.corridors)))]
    for _ in range(DRAWS if count else 0):
        boxes = _row(rule, random, corridor, count, places, site)
        if len(boxes) == count:
            return boxes
    if count:
        raise NoRoom(f"a corridor of {corridor.length:.1f} m is too short for {count} boxes")
    return ()


def _row(
    rule: CorridorRule,
    random: np.random.Generator,
    corridor: Corridor,
    count: int,
    places: Sequence[Block],
    site: tuple[float, float] | None,
) -> tuple[Block, ...]:
    """Return as many boxes as fit from where the row begins, which is drawn."""
    low, high = corridor.inner.begin + FROM_CORNER, corridor.inner.end - FROM_CORNER
    if low >= high:
        return ()
    begin, side = float(random.uniform(low, high)), int(random.integers(2))
    boxes: list[Block] = []
    for number in range(count):
        length, height = float(random.uniform(*rule.box_size)), float(random.uniform(*rule.box_height))
        reach = (corridor.width - rule.passage) / 2.0 - float(random.uniform(0.0, SHORTER))
        face = (corridor.outer, corridor.inner)[(number + side) % 2]
        while begin + length <= high:
            ends, depths = (begin, begin + length), (0.0, max(reach, MIN_BOX))
            box = face.block(f"box_{number + 1}", ends, depths, height, rule.box_material)
            begin += STEP
            if _is_clear(rule, box, places, site):
                boxes.append(box)
                break
        begin += length - STEP + float(random.uniform(*GAP))
    return tuple(boxes)


def _is_clear(rule: CorridorRule, box: Block, places: Sequence[Block], site: tuple[float, float] | None) -> bool:
    if site is not None and rule.clear is not None and distance_to_blocks(*site, [box]) < rule.clear[1]:
        return False
    return all(distance_between(box, place) >= FROM_PLACE for place in places)
