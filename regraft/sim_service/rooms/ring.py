"""A ring of four corridors around a core, passed through counter-clockwise as seen from above."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from regraft.sim_service.rooms.blocks import Rectangle
from regraft.sim_service.rooms.corridor_rule import CorridorRule
from regraft.sim_service.rooms.faces import MIN_GAP, Face

END: Final = 0.1
"""m of an inner wall, beyond the wall of the next corridor, without recesses."""


@dataclass(frozen=True, slots=True)
class Corridor:
    """A corridor between its outer wall and the core; its middle line goes from corner to corner of the ring."""

    width: float
    outer: Face
    inner: Face
    begin: float
    """m, on the axis of its walls: where the ring enters it."""
    end: float

    @property
    def length(self) -> float:
        """The length (m) of its middle line."""
        return abs(self.end - self.begin)

    def along(self, travelled: float) -> float:
        """Return the place (m) on the axis of its walls of somebody who has come so far (m) in it."""
        return self.begin + travelled * (1.0 if self.end > self.begin else -1.0)


@dataclass(frozen=True, slots=True)
class Ring:
    """The southern, eastern, northern and western corridor."""

    corridors: tuple[Corridor, ...]

    @property
    def length(self) -> float:
        """The length (m) of the middle line once around."""
        return sum(corridor.length for corridor in self.corridors)

    @property
    def faces(self) -> tuple[Face, ...]:
        """All walls: outer and inner of each corridor."""
        return tuple(face for corridor in self.corridors for face in (corridor.outer, corridor.inner))

    def with_faces(self, faces: Sequence[Face]) -> Ring:
        """Return the ring with these walls, in the order of ``faces``."""
        pairs = zip(faces[::2], faces[1::2], strict=True)
        each = zip(self.corridors, pairs, strict=True)
        return Ring(tuple(replace(corridor, outer=outer, inner=inner) for corridor, (outer, inner) in each))

    def place(self, travelled: float) -> tuple[Corridor, float]:
        """Return the corridor and the place (m) along it, so far (m) from the middle of the southern one."""
        left = (travelled + self.corridors[0].length / 2.0) % self.length
        for corridor in self.corridors:
            if left <= corridor.length:
                break
            left -= corridor.length
        return corridor, corridor.along(left)


def ring_of(rule: CorridorRule, widths: Sequence[float]) -> tuple[Ring, Rectangle]:
    """Return the ring of corridors of these widths (m; south, east, north, west), and the core with its walls."""
    (west, east), (south, north) = rule.x, rule.y
    of_south, of_east, of_north, of_west = widths
    core = (west + of_west, south + of_south, east - of_east, north - of_north)
    middle_x, middle_y = (west + of_west / 2.0, east - of_east / 2.0), (south + of_south / 2.0, north - of_north / 2.0)
    inner = rule.thickness + END

    def corridor(name: str, width: float, is_along_x: bool, facing: float, middle: tuple[float, float]) -> Corridor:
        first, last = (rule.x, rule.y) if is_along_x else (rule.y, rule.x)
        outer_at = last[0] if facing > 0.0 else last[1]
        begin, end = (core[0], core[2]) if is_along_x else (core[1], core[3])
        outer = Face(f"{name}_outer", is_along_x, outer_at, facing, *first, MIN_GAP, is_outer=True)
        core_face = Face(
            f"{name}_inner", is_along_x, outer_at + facing * width, -facing, begin, end, inner, is_outer=False
        )
        return Corridor(width, outer, core_face, *middle)

    corridors = (
        corridor("south", of_south, True, 1.0, middle_x),
        corridor("east", of_east, False, -1.0, middle_y),
        corridor("north", of_north, True, -1.0, middle_x[::-1]),
        corridor("west", of_west, False, 1.0, middle_y[::-1]),
    )
    return Ring(corridors), core
