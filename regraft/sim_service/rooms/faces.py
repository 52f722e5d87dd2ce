"""The faces of walls along a ring of corridors: where they run, and how recesses are spread over them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from regraft.sim_service.rooms.blocks import Block, NoRoom

BARE: Final = 6.0
"""m of smooth wall, at most, where there are recesses enough."""
MIN_GAP: Final = 0.3
"""m of wall between two recesses."""
DRAWS: Final = 30
"""Draws of the gaps of one face."""

Stretch = tuple[float, float]
"""From where to where, in m."""


@dataclass(frozen=True, slots=True)
class Opening:
    """A door or a niche that has no place yet: its length and depth (m), and whether a frame sticks out round it."""

    kind: str
    length: float
    depth: float
    has_frame: bool = False


@dataclass(frozen=True, slots=True)
class Recess:
    """A door or a niche, and where it begins (m along its face)."""

    opening: Opening
    begin: float

    @property
    def end(self) -> float:
        """Where it ends, in m along its face."""
        return self.begin + self.opening.length


@dataclass(frozen=True, slots=True)
class Face:
    """One side of a corridor, along x or y, from ``begin`` to ``end`` (m, map frame)."""

    name: str
    is_along_x: bool
    at: float
    """m: where it lies on the other axis."""
    facing: float
    """1.0 if the corridor lies on the side of larger values of the other axis, else -1.0."""
    begin: float
    end: float
    margin: float
    """m at both ends without recesses."""
    is_outer: bool
    """Whether it is opposite the core; else it is the core's."""
    recesses: tuple[Recess, ...] = ()
    """In the order of their places."""

    @property
    def length(self) -> float:
        """The length (m) of the face."""
        return self.end - self.begin

    def point(self, along: float, before: float) -> tuple[float, float]:
        """Return x and y (m) of a point so far along, and so far before the face."""
        across = self.at + self.facing * before
        return (along, across) if self.is_along_x else (across, along)

    def block(self, name: str, along: Stretch, before: Stretch, height: float, material: str) -> Block:
        """Return a block between two places along the face, and between two distances (m) before it."""
        x, y = self.point(sum(along) / 2.0, sum(before) / 2.0)
        half_length, half_depth = (along[1] - along[0]) / 2.0, (before[1] - before[0]) / 2.0
        halves = (half_length, half_depth) if self.is_along_x else (half_depth, half_length)
        return Block(name, x, y, *halves, height, material=material)

    def smooth(self) -> Iterator[Stretch]:
        """Return the stretches before, between and behind the recesses."""
        begin = self.begin
        for recess in self.recesses:
            yield begin, recess.begin
            begin = recess.end
        yield begin, self.end


def spread(random: np.random.Generator, faces: Sequence[Face], openings: Sequence[Opening]) -> tuple[Face, ...]:
    """Return the faces with recesses, spread so that the smooth stretches are short.

    Raises:
        NoRoom: they are too many for the walls.
    """
    shares: list[list[Opening]] = [[] for _ in faces]
    for opening in openings:
        emptiest = max(range(len(faces)), key=lambda index: faces[index].length / (len(shares[index]) + 1))
        shares[emptiest].append(opening)
    return tuple(_with_recesses(random, face, share) for face, share in zip(faces, shares, strict=True))


def _with_recesses(random: np.random.Generator, face: Face, share: Sequence[Opening]) -> Face:
    along, recesses = face.begin, []
    for opening, gap in zip(share, _gaps(random, face, share), strict=False):
        recesses.append(Recess(opening, along + gap))
        along = recesses[-1].end
    return replace(face, recesses=tuple(recesses))


def _gaps(random: np.random.Generator, face: Face, share: Sequence[Opening]) -> list[float]:
    """Draw the smooth stretches (m) before, between and behind recesses: none longer than `BARE`, if that can be."""
    least = np.full(len(share) + 1, MIN_GAP)
    least[[0, -1]] = face.margin
    free = face.length - sum(opening.length for opening in share) - float(least.sum())
    if share and free < 0.0:
        raise NoRoom(f"the wall {face.name} is too short for {len(share)} doors and niches")
    for _ in range(DRAWS):
        weights = random.uniform(0.4, 1.6, len(least))
        gaps = least + free * weights / weights.sum()
        if gaps.max() <= BARE:
            return list(gaps.tolist())
    return list((least + free / len(least)).tolist())
