"""A bumper around a robot."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

import mujoco
import numpy as np

from regraft import Output, Parameter
from regraft.bus_schema.messages.devices.touch import BumperState, Touch
from regraft.sim_service.contacts import bodies_around
from regraft.sim_service.devices.core.failure_schedule import DROPOUT, STUCK
from regraft.sim_service.devices.core.sensor import Sensor, failure_parameter
from regraft.sim_service.layout.headings import wrap_heading


class Bumper(Sensor):
    """Feels which bodies the robot touches, and on which side; the floor does not count.

    It looks at the last physics step of every control period. It reports all contacts since its last message.
    Without a ``threshold`` it feels every contact that MuJoCo finds. Eight sectors are a choice; a Kobuki's bumper has
    three switches (Yujin Robot, Kobuki user guide: left, centre, right).
    """

    measures = "bumps"

    bumps = Output(BumperState, description="the bodies that the robot touches")

    geoms = Parameter("", "MJCF geoms that feel, with spaces between; empty: all of the robot", read_only=True)
    sectors = Parameter(8, "equal parts of the circle around the base", minimum=1, maximum=360, read_only=True)
    threshold = Parameter(0.0, "pressing force from which it feels a contact", minimum=0.0, unit="N")
    failure = failure_parameter(DROPOUT, STUCK)
    dropout = Parameter(0.5, "share of the touches that a dropout loses", minimum=0.0, maximum=1.0)
    stuck_sector = Parameter(0, "sector that seems pressed while the bumper is stuck", minimum=0)

    def build(self) -> None:
        """Find the geoms; raises SceneError."""
        kit = self.kit
        robot = frozenset(kit.scene.geoms_of(kit.base))
        named = [kit.index("geom", name) for name in self.geoms.split()]
        self._feeling = frozenset(named) or robot
        self._bodies = bodies_around(kit.scene, robot)
        self._touches: dict[tuple[str, int], tuple[int, float]] = {}
        """The last touch of each body in each sector: the physics step, and the bearing (rad)."""

    def watch(self) -> None:
        """Note the contacts of the last physics step."""
        steps = self.kit.progress.steps
        for body, bearing in self._contacts():
            width = 2.0 * math.pi / self.sectors
            self._touches[body, round(bearing / width) % self.sectors] = (steps, bearing)

    def _contacts(self) -> Iterator[tuple[str, float]]:
        data, base = self.kit.data, self.kit.base
        for number, (one, other) in enumerate(data.contact.geom.tolist()):
            body = self._bodies.get(other if one in self._feeling else one)
            if body is None or not (one in self._feeling or other in self._feeling):
                continue
            if self.threshold > 0.0 and self._force(number) < self.threshold:
                continue
            # The last step began with the positions at which it found its contacts.
            away = data.xmat[base].reshape(3, 3).T @ (data.contact.pos[number] - data.xpos[base])
            yield body, wrap_heading(math.atan2(away[1], away[0]))

    def _force(self, contact: int) -> float:
        force = np.empty(6)
        mujoco.mj_contactForce(self.kit.model, self.kit.data, contact, force)
        return float(force[0])

    def measure(self) -> BumperState:
        """Return the touches of the last period, spoiled by what fails."""
        progress = self.kit.progress
        since = progress.steps - self.kit.ticks_since_due(self.rate) * progress.steps_per_tick
        self._touches = {key: touch for key, touch in self._touches.items() if touch[0] > since}
        touches = [Touch(body, sector, bearing) for (body, sector), (_, bearing) in sorted(self._touches.items())]
        return BumperState(self.kit.stamp, self.kit.frame("base_link"), self.sectors, tuple(self._spoiled(touches)))

    def _spoiled(self, touches: list[Touch]) -> list[Touch]:
        if self.kit.failing == STUCK:
            sector = self.stuck_sector % self.sectors
            return [Touch("", sector, wrap_heading(sector * 2.0 * math.pi / self.sectors)), *touches]
        if self.kit.failing == DROPOUT:
            chances = self.kit.random(f"{self.kit.name} dropout", self.kit.progress.tick).random(len(touches))
            return [touch for touch, chance in zip(touches, chances, strict=True) if chance >= self.dropout]
        return touches

    def snapshot(self) -> dict[str, Any]:
        """Return the touches that are not published yet, and the last message."""
        touches = [[*key, *touch] for key, touch in sorted(self._touches.items())]
        return {**super().snapshot(), "touches": touches}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take over touches and the last message."""
        super().restore(state)
        self._touches = {
            (str(body), int(sector)): (int(step), float(bearing)) for body, sector, step, bearing in state["touches"]
        }
