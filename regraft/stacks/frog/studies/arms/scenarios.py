"""The circumstances in which the arms are compared, each drawn from the seed."""

from __future__ import annotations

from random import Random
from typing import Final

from regraft.evaluation.study import Changes
from regraft.stacks.frog.studies.blocking import blocked

BLOCKED, ROOMS = "blocked", "rooms"
ALL: Final = (BLOCKED, ROOMS)


def while_blocked(seed: int) -> Changes:
    """Return what has the corner camera of FROG's own room be black for 30 % of the time."""
    return {"components": {"corner_camera": {"parameters": {"failures": blocked(seed)}}}}


IN_VIEW: Final = 1 / 3
"""The share of rooms whose hydrant is placed in the corner camera's view; of the others it sees it in a quarter."""


def in_other_rooms(seed: int) -> Changes:
    """Return what gives each seed a room and a light of its own.

    Walls, boxes and lamps are drawn by the world's rule. The corner camera sees the hydrant in about half of the rooms.
    The light comes and goes at another pace, begins elsewhere, and is not always gone at its darkest.
    """
    world = "rooms_in_view.xml" if Random(f"view {seed}").random() < IN_VIEW else "rooms.xml"
    random = Random(f"light {seed}")
    period = random.uniform(100.0, 250.0)
    light = {"period": period, "phase": random.uniform(0.0, period), "darkest": random.uniform(0.6, 1.0)}
    rounded = {name: round(value, 3) for name, value in light.items()}
    return {"world": world, "components": {"lighting": {"parameters": rounded}}}


SCENARIOS: Final = {BLOCKED: while_blocked, ROOMS: in_other_rooms}
