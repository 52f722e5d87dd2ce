"""Drawing a room: inner walls with doors, boxes between them, and how bright it is."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Final

import numpy as np

from regraft.sim_service.layout.footprints import distance_to_rectangles
from regraft.sim_service.layout.random_streams import generator
from regraft.sim_service.rooms.blocks import Block, NoRoom, Rectangle, Room, distance_to_blocks
from regraft.sim_service.rooms.rule import RoomRule

PURPOSE: Final = "room"
HALF_THICKNESS: Final = 0.05
"""m, of an inner wall."""
CHAMBER: Final = 1.2
"""m that a wall leaves at least on either side."""
MAX_DRAWS: Final = 200
"""Draws of a place for one box."""


def draw_room(rule: RoomRule, seed: int, attempt: int, site: tuple[float, float] | None) -> Room:
    """Draw a room; ``site`` (x, y in m) is what the rule keeps clear. Each attempt has random numbers of its own.

    Raises:
        NoRoom: a wall or a box found no place.
    """
    random = generator(seed, PURPOSE, attempt)
    lamps = float(random.uniform(*rule.lamps))
    walls = _draw_walls(rule, random, int(random.integers(rule.walls[0], rule.walls[1] + 1)))
    if site is not None and rule.clear is not None and distance_to_blocks(*site, walls) < rule.clear[1]:
        raise NoRoom(f"a wall stands within {rule.clear[1]:g} m of the site {rule.clear[0]!r}")
    boxes: list[Block] = []
    for number in range(int(random.integers(rule.boxes[0], rule.boxes[1] + 1))):
        boxes.append(_draw_box(rule, random, f"box_{number + 1}", (*walls, *boxes), site))
    return Room(tuple(walls), tuple(boxes), lamps, tuple(box.name for box in boxes[: rule.visits]))


def _draw_walls(rule: RoomRule, random: np.random.Generator, count: int) -> list[Block]:
    """Return the parts of the walls: each parts the largest chamber, more often across its longer side."""
    chambers: list[Rectangle] = [(rule.x[0], rule.y[0], rule.x[1], rule.y[1])]
    parts: list[Block] = []
    for number in range(count):
        chambers.sort(key=lambda each: (each[2] - each[0]) * (each[3] - each[1]))
        low_x, low_y, high_x, high_y = chambers.pop()
        height = float(random.uniform(*rule.wall_height))
        width, depth = high_x - low_x, high_y - low_y
        is_along_y = bool(random.uniform(0.0, width + depth) < width)
        across, along = ((low_x, high_x), (low_y, high_y)) if is_along_y else ((low_y, high_y), (low_x, high_x))
        at = _between(random, across[0] + CHAMBER, across[1] - CHAMBER, "a wall")
        door = float(random.uniform(*rule.door))
        begin = _between(random, along[0], along[1] - door, "a door")
        for side, (low, high) in enumerate(((along[0], begin), (begin + door, along[1]))):
            middle, half = (low + high) / 2.0, (high - low) / 2.0
            if half <= HALF_THICKNESS:
                continue
            name = f"wall_{number + 1}_{'ab'[side]}"
            place = (at, middle, HALF_THICKNESS, half) if is_along_y else (middle, at, half, HALF_THICKNESS)
            parts.append(Block(name, *place, height, material=rule.wall_material))
        if is_along_y:
            chambers += [(low_x, low_y, at, high_y), (at, low_y, high_x, high_y)]
        else:
            chambers += [(low_x, low_y, high_x, at), (low_x, at, high_x, high_y)]
    return parts


def _between(random: np.random.Generator, low: float, high: float, what: str) -> float:
    if low > high:
        raise NoRoom(f"a chamber is too small for {what}")
    return float(random.uniform(low, high))


def _draw_box(
    rule: RoomRule,
    random: np.random.Generator,
    name: str,
    others: Iterable[Block],
    site: tuple[float, float] | None,
) -> Block:
    half_x, half_y = (float(half) for half in random.uniform(*rule.box_size, size=2) / 2.0)
    height, radius = float(random.uniform(*rule.box_height)), math.hypot(half_x, half_y)
    margin = radius + rule.gap
    taken = [other.rectangle() for other in others]
    for _ in range(MAX_DRAWS):
        x = _between(random, rule.x[0] + margin, rule.x[1] - margin, "a box")
        y = _between(random, rule.y[0] + margin, rule.y[1] - margin, "a box")
        yaw = float(random.uniform(-math.pi, math.pi))
        is_clear = site is None or rule.clear is None or math.hypot(x - site[0], y - site[1]) >= radius + rule.clear[1]
        if is_clear and distance_to_rectangles(x, y, np.array(taken).reshape(-1, 4)) >= margin:
            return Block(name, x, y, half_x, half_y, height, yaw, rule.box_material)
    raise NoRoom(f"{name} found no place in {MAX_DRAWS} draws")
