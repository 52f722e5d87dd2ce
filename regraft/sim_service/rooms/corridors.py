"""Drawing a ring of corridors around a solid core: its walls with doors and niches, places to visit, and clutter."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count
from typing import Final

import numpy as np

from regraft.sim_service.layout.random_streams import generator
from regraft.sim_service.rooms.blocks import Block, Rectangle, Room, distance_to_blocks
from regraft.sim_service.rooms.clutter import draw_clutter
from regraft.sim_service.rooms.corridor_rule import CorridorRule
from regraft.sim_service.rooms.faces import Face, Opening, Recess, spread
from regraft.sim_service.rooms.places import draw_places
from regraft.sim_service.rooms.ring import ring_of

PURPOSE: Final = "corridors"
BODY: Final = "walls"
DOOR, NICHE = "door", "niche"
FRAMED: Final = 0.35
"""Share of the doors that have a frame."""
FRAME_WIDTH: Final = 0.08
"""m of a post of a frame."""
FRAME_DEPTH: Final = 0.05
"""m that a frame sticks out: a cell of the map."""


def draw_corridors(rule: CorridorRule, seed: int, attempt: int, site: tuple[float, float] | None) -> Room:
    """Draw the corridors; ``site`` (x, y in m) is what the rule keeps clear. Each attempt has its own random numbers.

    Raises:
        NoRoom: a door, a place to visit or a box found no place.
    """
    random = generator(seed, PURPOSE, attempt)
    lamps, height = float(random.uniform(*rule.lamps)), float(random.uniform(*rule.wall_height))
    ring, core = ring_of(rule, [float(width) for width in random.uniform(*rule.width, size=4)])
    ring = ring.with_faces(spread(random, ring.faces, _draw_openings(rule, random)))
    places = draw_places(rule, random, ring, height, site)
    boxes = draw_clutter(rule, random, ring, places, site)
    walls = (_core(rule, core, height), *_walls(rule, ring.faces, height, site))
    return Room(walls, (*places, *boxes), lamps, tuple(place.name for place in places), BODY)


def _draw_openings(rule: CorridorRule, random: np.random.Generator) -> list[Opening]:
    """Draw doors and niches, in any order."""
    doors = int(random.integers(rule.doors[0], rule.doors[1] + 1))
    niches = int(random.integers(rule.niches[0], rule.niches[1] + 1))
    openings = []
    for _ in range(doors):
        length, depth = float(random.uniform(*rule.door)), float(random.uniform(*rule.door_depth))
        openings.append(Opening(DOOR, length, depth, bool(random.uniform() < FRAMED)))
    for _ in range(niches):
        length, depth = float(random.uniform(*rule.niche_size)), float(random.uniform(*rule.niche_depth))
        openings.append(Opening(NICHE, length, depth))
    return [openings[index] for index in random.permutation(len(openings)).tolist()]


def _core(rule: CorridorRule, core: Rectangle, height: float) -> Block:
    """Return what lies behind the walls of the core."""
    low_x, low_y, high_x, high_y = core
    half_x, half_y = ((high_x - low_x) / 2.0 - rule.thickness, (high_y - low_y) / 2.0 - rule.thickness)
    middle_x, middle_y = (low_x + high_x) / 2.0, (low_y + high_y) / 2.0
    return Block("core", middle_x, middle_y, half_x, half_y, height, material=rule.wall_material)


def _walls(
    rule: CorridorRule, faces: tuple[Face, ...], height: float, site: tuple[float, float] | None
) -> Iterator[Block]:
    """Return the walls behind all faces: the smooth parts, the backs of doors and niches, and the frames of doors."""
    numbers = {DOOR: count(1), NICHE: count(1)}
    for face in faces:
        beyond = rule.thickness if face.is_outer else 0.0
        for number, (begin, end) in enumerate(face.smooth(), start=1):
            ends = (begin - beyond * (begin == face.begin), end + beyond * (end == face.end))
            name = f"wall_{face.name}_{number}"
            yield face.block(name, ends, (-rule.thickness, 0.0), height, rule.wall_material)
        for recess in face.recesses:
            kind = recess.opening.kind
            material = rule.door_material if kind == DOOR else rule.wall_material
            name, ends = f"{kind}_{next(numbers[kind])}", (recess.begin, recess.end)
            yield face.block(name, ends, (-rule.thickness, -recess.opening.depth), height, material)
            for post in _frame(rule, face, recess, f"{name}_frame", height):
                if site is None or rule.clear is None or distance_to_blocks(*site, [post]) >= rule.clear[1]:
                    yield post


def _frame(rule: CorridorRule, face: Face, recess: Recess, name: str, height: float) -> Iterator[Block]:
    if not recess.opening.has_frame:
        return
    for side, (begin, end) in enumerate(
        ((recess.begin - FRAME_WIDTH, recess.begin), (recess.end, recess.end + FRAME_WIDTH))
    ):
        yield face.block(f"{name}_{'ab'[side]}", (begin, end), (0.0, FRAME_DEPTH), height, rule.door_material)
