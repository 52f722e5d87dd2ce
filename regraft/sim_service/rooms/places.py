"""Drawing the places to visit along a ring of corridors: boards at its walls."""

from __future__ import annotations

from typing import Final

import numpy as np

from regraft.sim_service.rooms.blocks import Block, NoRoom, distance_between, distance_to_blocks
from regraft.sim_service.rooms.corridor_rule import CorridorRule
from regraft.sim_service.rooms.faces import Face
from regraft.sim_service.rooms.ring import Ring

WIDTH: Final = (0.3, 0.6)
"""m of a board."""
DEPTH: Final = 0.12
HEIGHT: Final = 1.0
FROM_RECESS: Final = 0.15
"""m between a board and a door with its frame."""
FROM_CORNER: Final = 0.7
"""m between a board and the next outer wall."""
APART: Final = 0.3
"""m between two boards."""
JITTER: Final = 0.1
"""Share of the distance between two places by which a place is drawn to lie elsewhere."""
FARTHEST: Final = 0.25
"""Share of the distance between two places by which it may lie elsewhere because of doors."""


def draw_places(
    rule: CorridorRule, random: np.random.Generator, ring: Ring, height: float, site: tuple[float, float] | None
) -> tuple[Block, ...]:
    """Draw the places to visit, in their order around the ring from the middle of the southern corridor.

    Raises:
        NoRoom: a place finds no wall between the doors, or lies where the rule keeps clear.
    """
    places: list[Block] = []
    for number in range(rule.visits):
        step = ring.length / rule.visits
        travelled = step * (number + 0.5 + float(random.uniform(-JITTER, JITTER)))
        width, is_outer = float(random.uniform(*WIDTH)), bool(random.uniform() < 0.5)
        corridor, wanted = ring.place(travelled)
        sides = (corridor.outer, corridor.inner) if is_outer else (corridor.inner, corridor.outer)
        at = [(face, found) for face in sides for found in _nearest(face, wanted, width / 2.0, FARTHEST * step)]
        name = f"place_{number + 1}"
        if not at:
            raise NoRoom(f"{name} found no wall between doors and niches")
        face, along = at[0]
        reach = (along - width / 2.0, along + width / 2.0)
        place = face.block(name, reach, (0.0, DEPTH), min(height, HEIGHT), rule.place_material)
        if any(distance_between(place, other) < APART for other in places):
            raise NoRoom(f"{name} stands too near to another place")
        if site is not None and rule.clear is not None and distance_to_blocks(*site, [place]) < rule.clear[1]:
            raise NoRoom(f"{name} stands within {rule.clear[1]:g} m of the site {rule.clear[0]!r}")
        places.append(place)
    return tuple(places)


def _nearest(face: Face, wanted: float, half: float, farthest: float) -> list[float]:
    """Return the place (m along a face) nearest to the wanted one where a board fits; none if all are too far."""
    found = []
    from_end = FROM_CORNER if face.is_outer else FROM_RECESS
    for begin, end in face.smooth():
        low = begin + half + (from_end if begin == face.begin else FROM_RECESS)
        high = end - half - (from_end if end == face.end else FROM_RECESS)
        if low <= high:
            found.append(min(max(wanted, low), high))
    found.sort(key=lambda along: abs(along - wanted))
    return [along for along in found[:1] if abs(along - wanted) <= farthest]
