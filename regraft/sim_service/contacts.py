"""The robot's contacts."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from regraft.sim_service.layout.scene import Scene

REBOUND = 0.5
"""A touch within this time (s) of the last one is the same contact: pushing bodies part and meet again."""


HOLD = 0.1
"""So long (s) after the last touch a body still counts as touched: against a wall the robot trembles."""


@dataclass(frozen=True, slots=True)
class ContactEvent:
    """The robot began to touch a body at a time (s)."""

    time: float
    body: str


def bodies_around(scene: Scene, robot: Collection[int]) -> dict[int, str]:
    """Return the names of the bodies that a robot with these geoms can touch, by their geoms.

    Bodies are named by their outermost body. Geoms directly on the worldbody are the floor and are left out.
    """
    root_of_geom = scene.model.body_rootid[scene.model.geom_bodyid]
    return {
        geom: scene.body_name(root)
        for geom, root in enumerate(root_of_geom.tolist())
        if root != 0 and geom not in robot
    }


class ContactMonitor:
    """Watches which bodies a robot touches: those of `bodies_around`."""

    def __init__(self, scene: Scene, body: str) -> None:
        self._robot = frozenset(scene.geoms_of(scene.index("body", body)))
        self._bodies = bodies_around(scene, self._robot)
        self._last_touch: dict[str, float] = {}
        self._events: list[ContactEvent] = []

    def update(self, touching: Sequence[Sequence[int]], time: float) -> None:
        """Look at the contacts of the last physics step, pairs of geoms, at a time (s)."""
        touched = set()
        for one, other in touching:
            if one in self._robot:
                if other in self._bodies:
                    touched.add(self._bodies[other])
            elif other in self._robot and one in self._bodies:
                touched.add(self._bodies[one])
        for name in sorted(touched):
            if time - self._last_touch.get(name, -math.inf) > REBOUND:
                self._events.append(ContactEvent(time, name))
            self._last_touch[name] = time

    def touching(self, time: float) -> frozenset[str]:
        """Return the bodies touched at a time (s), which must not lie before the last update."""
        return frozenset(name for name, last in self._last_touch.items() if time - last <= HOLD)

    def take_events(self) -> tuple[ContactEvent, ...]:
        """Return the contacts that began since the last call, oldest first, and forget them."""
        events = tuple(self._events)
        self._events.clear()
        return events

    def snapshot(self) -> dict[str, Any]:
        """Return touches and waiting events as plain data."""
        return {
            "last_touch": dict(sorted(self._last_touch.items())),
            "events": [[event.time, event.body] for event in self._events],
        }

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        """Take over touches and waiting events of a snapshot."""
        self._last_touch = {str(name): float(time) for name, time in snapshot["last_touch"].items()}
        self._events = [ContactEvent(float(time), str(body)) for time, body in snapshot["events"]]
