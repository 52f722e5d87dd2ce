"""Stubs of SUAVE's nodes: they have its names, parameters and lifecycle, and take as long as is stated here.

No vehicle moves. An active search covers ground, an active follower inspects pipeline, an active recharger reaches
the station. Thrusters that have failed slow nothing down.
"""

from __future__ import annotations

import math
from typing import Final

from regraft import Component, Input, Level, Output, Parameter, every
from regraft.bus_schema.messages.health import Diagnostic
from regraft.bus_schema.messages.management.objectives import COMPONENT_STATUS, QUALITY_STATUS
from regraft.stacks.suave.messages import Detection, Inspection, Recharge, Recharged, Search
from regraft.stacks.suave.monitors import RECOVERED, THRUSTERS, thruster_name

FIELD_OF_VIEW: Final = math.pi / 3.0
"""rad: SUAVE's camera."""


def marker() -> Parameter[str]:
    """Return the parameter that stands for the mode where a node has no other."""
    return Parameter("__DEFAULT__", "the mode in which the component is")


class SpiralSearch(Component):
    """Stub of ``f_generate_search_path_node``: while it is active the vehicle searches at ``spiral_altitude``."""

    spiral_altitude = Parameter(2.0, "altitude over the ground", minimum=0.1, maximum=20.0, unit="m")

    search = Output(Search, description="that it has searched, and how high")

    @every(seconds=1.0)
    def report(self) -> None:
        """Report the second that was searched."""
        self.search.publish(Search(self.kit.now(), self.spiral_altitude))


class PipelineDetection(Component):
    """Stub of ``detect_pipeline``: the pipeline is seen when enough ground has been.

    The ground is seen as far as the water lets the camera: not at all from an altitude above the visibility.
    """

    speed = Parameter(0.3, "of the vehicle along its path", minimum=0.01, maximum=10.0, unit="m/s")
    area = Parameter(65.0, "ground that has to be seen first", minimum=0.0, unit="m2")

    search = Input(Search, required=False, description="where the vehicle searches")
    diagnostics = Input(Diagnostic, description="the visibility of the water")
    detection = Output(Detection)

    def on_activate(self) -> None:
        """Begin without having seen anything."""
        self._seen, self._visibility = 0.0, 0.0

    @diagnostics.handler
    def hear(self, diagnostic: Diagnostic) -> None:
        """Take the visibility of the water."""
        value = diagnostic.values.get("water_visibility")
        if diagnostic.text == QUALITY_STATUS and isinstance(value, float):
            self._visibility = value

    @search.handler
    def look(self, search: Search) -> None:
        """Add a second's stretch of ground, as wide as the camera sees from there."""
        if search.altitude <= self._visibility:
            self._seen += self.speed * 2.0 * search.altitude * math.tan(FIELD_OF_VIEW / 2.0)

    @every(seconds=1.0)
    def report(self) -> None:
        """Publish whether the pipeline has been seen."""
        self.detection.publish(Detection(self.kit.now(), self._seen >= self.area))


class PipelineFollower(Component):
    """Stub of ``f_follow_pipeline_node``: while it is active the vehicle inspects the pipeline at a constant speed."""

    system_mode_marker = marker()
    speed = Parameter(0.27, "of the inspection", minimum=0.01, maximum=10.0, unit="m/s")
    length = Parameter(100.0, "of the pipeline, there and back", minimum=0.0, unit="m")

    inspection = Output(Inspection)

    def on_configure(self) -> None:
        """Begin at the beginning of the pipeline."""
        self._distance = 0.0

    @every(seconds=1.0)
    def report(self) -> None:
        """Add the second's stretch."""
        self._distance = min(self.length, self._distance + self.speed)
        self.inspection.publish(Inspection(self.kit.now(), self._distance, self._distance >= self.length))


class RecoverThrusters(Component):
    """Stub of ``f_maintain_motion_node``: activated, it brings all thrusters back, one after the other."""

    system_mode_marker = marker()
    takes = Parameter(10.0, "time until the first one is back", minimum=0.0, maximum=600.0, unit="s")
    pause = Parameter(0.25, "time between two of them", minimum=0.05, maximum=60.0, unit="s")

    diagnostics = Output(Diagnostic, description="the thrusters that are back")

    def on_activate(self) -> None:
        """Begin with the first thruster."""
        self._began: float | None = None
        self._recovered = 0

    @every(seconds=pause)
    def recover(self) -> None:
        """Bring the next thruster back if it is time."""
        now = self.kit.now()
        # A component that was inactive knows the time from its first step on: an activation is no step.
        if self._began is None:
            self._began = now
        if now - self._began < self.takes or self._recovered == THRUSTERS:
            return
        self._recovered += 1
        name = thruster_name(self._recovered)
        self.diagnostics.publish(Diagnostic(now, self.kit.name, name, Level.OK, COMPONENT_STATUS, {name: RECOVERED}))


class RechargeBattery(Component):
    """Stub of ``generate_recharge_path_node``: activated, it is at the station after a while, and has it charge."""

    system_mode_marker = marker()
    travel_time = Parameter(20.0, "time to the station", minimum=0.0, maximum=3600.0, unit="s")

    def on_activate(self) -> None:
        """Begin to travel."""
        self._began: float | None = None
        self._is_charged = False

    @every(hz=2.0)
    async def recharge(self) -> None:
        """Have the battery filled, once, when the vehicle is there."""
        now = self.kit.now()
        if self._began is None:
            self._began = now
        if not self._is_charged and now - self._began >= self.travel_time:
            self._is_charged = True
            await self.kit.call("battery_monitor/recharge", Recharge(), Recharged)


class Thruster(Component):
    """Stub of a thruster. It does nothing; that it fails is reported by the thruster monitor."""
