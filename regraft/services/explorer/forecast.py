"""The forecast of an exploration, made before it begins."""

from __future__ import annotations

from regraft.bus_schema.annotations import PlainValue

USUAL_AREA = 22.0
"""m², of a room of FROG's size."""
DISTANCES = {"best": (2.6, 0.39), "furthest": (3.4, 0.52)}
"""Way (m) by strategy: for any room, and for each m² of its floor."""
REQUESTS = {"best": (3.9, 0.054), "furthest": (2.7, 0.053)}
"""Requests likewise. Both are lines through 68 rooms of 8 to 64 m² with two to eight boxes. The lidar reaches 3.5 m,
and the weights are the default ones. Single rooms lie within a half of them.
"""


def forecast(strategy: str, context: dict[str, PlainValue]) -> dict[str, float]:
    """Return the ``distance`` (m) to drive and the number of ``requests`` to explore ``context["area"]`` (m²).

    Raises:
        KeyError: there is no such strategy.
    """
    area = float(context.get("area", USUAL_AREA))
    (way, way_per_area), (requests, requests_per_area) = DISTANCES[strategy], REQUESTS[strategy]
    return {"distance": way + way_per_area * area, "requests": requests + requests_per_area * area}
