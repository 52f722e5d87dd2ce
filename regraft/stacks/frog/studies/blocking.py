"""When the corner camera is blocked in the third scenario."""

from __future__ import annotations

from random import Random
from typing import Final

from regraft.bus_schema.annotations import PlainValue

SECONDS: Final = 300.0
SHARE: Final = 0.30
SPELLS: Final = 6


def blocked(seed: int) -> list[dict[str, PlainValue]]:
    """Return the corner camera's failures: black for 30 % of 300 s in all, in six spells, drawn from the seed."""
    random = Random(f"corner camera {seed}")
    dark = _parts(random, SECONDS * SHARE, SPELLS)
    light = _parts(random, SECONDS * (1.0 - SHARE), SPELLS + 1)
    entries: list[dict[str, PlainValue]] = []
    time = 0.0
    for before, spell in zip(light[:-1], dark, strict=True):
        time += before
        entries.append({"at": round(time, 1), "failure": "black"})
        entries.append({"at": round(time + spell, 1), "failure": "none"})
        time += spell
    return entries


def _parts(random: Random, total: float, count: int) -> list[float]:
    """Return so many lengths that add up to a total, the shorter ones seldom."""
    drawn = [0.25 + 0.75 * random.expovariate(1.0) for _ in range(count)]
    return [length * total / sum(drawn) for length in drawn]
