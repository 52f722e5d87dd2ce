"""The robot's contacts."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco

from regraft.sim_service.layout.footprints import world_box
from regraft.sim_service.layout.scene import Scene

REBOUND = 0.5
"""A touch within this time (s) of the last one is the same contact: pushing bodies part and meet again."""

HOLD = 0.1
"""So long (s) after the last touch a body still counts as touched: against a wall the robot trembles."""
GROUND = 1e-3
"""Height (m) above which a geom of the worldbody is no floor."""
STEEPEST = math.cos(math.radians(45.0))
"""The z of a plane's normal below which it is a wall."""


@dataclass(frozen=True, slots=True)
class ContactEvent:
    """The robot began to touch a body at a time (s)."""

    time: float
    body: str


def bodies_around(scene: Scene, robot: Collection[int]) -> dict[int, str]:
    """Return the names of what a robot with these geoms can touch, by geoms; floors are left out.

    Bodies are named by their outermost body. A geom of the worldbody is a thing of its own, such as a wall.
    """
    root_of_geom = scene.model.body_rootid[scene.model.geom_bodyid]
    left_out = _floors(scene).union(robot)
    return {
        geom: scene.body_name(root) if root != 0 else scene.geom_name(geom)
        for geom, root in enumerate(root_of_geom.tolist())
        if geom not in left_out
    }


def _floors(scene: Scene) -> set[int]:
    """Return the geoms on which robots drive: level planes, height fields, and slabs of the worldbody."""
    model = scene.model
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    floors = set()
    for geom, kind in enumerate(model.geom_type.tolist()):
        if kind == mujoco.mjtGeom.mjGEOM_PLANE:
            is_floor = data.geom_xmat[geom][8] > STEEPEST
        elif kind == mujoco.mjtGeom.mjGEOM_HFIELD:
            is_floor = True
        else:
            is_floor = model.geom_bodyid[geom] == 0 and world_box(model, data, geom)[1][2] < GROUND
        if is_floor:
            floors.add(geom)
    return floors


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
