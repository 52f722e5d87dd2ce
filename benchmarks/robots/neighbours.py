"""A thousand neighbours of FROG's architecture estimated, each a part away from it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import replace

from benchmarks.harness import Effort, Result
from benchmarks.sides.full_speed import FROG
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.estimation.estimation import Estimation
from regraft.stack import load

NEIGHBOURS = 1000
LIMIT = 0.2
"""s for a thousand."""


def neighbours(effort: Effort) -> list[Result]:
    """Estimate neighbours by another parameter, connection or state, and one from scratch for comparison."""
    specs = load(FROG / "stack.yaml").architecture.components
    Estimation(specs)  # the cameras' class looks for a renderer once
    base = Estimation(specs)
    incremental, scratch = [], []
    for _ in range(effort.rounds):
        candidates = list(_neighbours(specs, effort.count(NEIGHBOURS, 10)))
        incremental.append(_seconds(base.changed, candidates))
        scratch.append(_seconds(Estimation, candidates[:100]))
    found, whole = min(incremental), min(scratch)
    return [
        Result(
            "a thousand neighbours of FROG estimated",
            found,
            "s",
            spread=(min(incremental), max(incremental)),
            limit=LIMIT,
            note=f"{len(specs)} components; the best of {effort.rounds} rounds; from scratch {whole:.2g} s",
        )
    ]


def _seconds(
    estimate: Callable[[dict[str, ComponentSpec]], object], candidates: list[dict[str, ComponentSpec]]
) -> float:
    """Return the seconds that a thousand would take."""
    begun = time.perf_counter()
    for each in candidates:
        estimate(each)
    return (time.perf_counter() - begun) * NEIGHBOURS / len(candidates)


def _neighbours(specs: dict[str, ComponentSpec], count: int) -> Iterator[dict[str, ComponentSpec]]:
    navigator, detector, camera = specs["navigator"], specs["detector"], specs["camera"]
    for number in range(count):
        if number % 4 == 0:
            changed = replace(navigator, parameters={**navigator.parameters, "max_velocity": 0.1 + 1e-4 * number})
        elif number % 4 == 1:
            changed = replace(camera, parameters={**camera.parameters, "rate": 1.0 + 0.01 * number})
        elif number % 4 == 2:
            changed = replace(detector, connections={**detector.connections, "image": "corner_camera/image"})
        else:
            changed = replace(detector, parameters={**detector.parameters, "pictures": 1 + number % 10})
        yield {**specs, changed.name: changed}
