"""The parts of a drawn room: upright boxes on the floor."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from regraft.sim_service.layout.footprints import distance_to_rectangles

Rectangle = tuple[float, float, float, float]
"""x_min, y_min, x_max, y_max in m."""


class NoRoom(Exception):
    """A draw that came to nothing: something found no place."""


@dataclass(frozen=True, slots=True)
class Block:
    """An upright box on the floor: the place of its middle, half its sides (m), its height (m), and its heading."""

    name: str
    x: float
    y: float
    half_x: float
    half_y: float
    height: float
    yaw: float = 0.0
    material: str = ""

    def rectangle(self) -> Rectangle:
        """Return the rectangle along the axes that contains it."""
        across, along = abs(math.cos(self.yaw)), abs(math.sin(self.yaw))
        reach_x = self.half_x * across + self.half_y * along
        reach_y = self.half_x * along + self.half_y * across
        return self.x - reach_x, self.y - reach_y, self.x + reach_x, self.y + reach_y

    def distance(self, x: float, y: float) -> float:
        """Return the distance (m) from a point to the block: 0 inside."""
        across, along = math.cos(self.yaw), math.sin(self.yaw)
        right, up = x - self.x, y - self.y
        beyond_x = max(abs(across * right + along * up) - self.half_x, 0.0)
        beyond_y = max(abs(across * up - along * right) - self.half_y, 0.0)
        return math.hypot(beyond_x, beyond_y)


@dataclass(frozen=True, slots=True)
class Room:
    """A room as drawn; ``lamps`` is the brightness of the lamps, 1 being as the file has it."""

    walls: tuple[Block, ...]
    """The geoms of one body."""
    boxes: tuple[Block, ...]
    """A body each, of its name."""
    lamps: float
    goals: tuple[str, ...] = ()
    """The boxes to visit, in order."""
    body: str = "inner_walls"
    """The body of all walls."""


def distance_to_blocks(x: float, y: float, blocks: Iterable[Block]) -> float:
    """Return the distance (m) from a point to the nearest block: 0 inside, infinity if there is none."""
    return distance_to_rectangles(x, y, np.array([block.rectangle() for block in blocks]).reshape(-1, 4))


def distance_between(one: Block, other: Block) -> float:
    """Return the distance (m) between the rectangles of two blocks: 0 if they touch or overlap."""
    low_x, low_y, high_x, high_y = one.rectangle()
    other_low_x, other_low_y, other_high_x, other_high_y = other.rectangle()
    beyond_x = max(other_low_x - high_x, low_x - other_high_x, 0.0)
    beyond_y = max(other_low_y - high_y, low_y - other_high_y, 0.0)
    return math.hypot(beyond_x, beyond_y)
