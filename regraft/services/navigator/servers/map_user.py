"""The base of the servers: the ports of the senses and the robot's data."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from regraft import Component, Input, Parameter, RefusalCode, RequestRefused
from regraft.bus_schema.messages import maps, sensors
from regraft.bus_schema.messages.health import Level
from regraft.bus_schema.messages.nav2.paths import ClearCostmap, CostmapCleared
from regraft.services import robot_parameters
from regraft.services.navigator.driving.robot import Footprint
from regraft.services.navigator.planning.terrain import Inflation
from regraft.services.navigator.sensing.sight import FORGET_TIMEOUT
from regraft.services.navigator.servers.surroundings import Area, BadMap, Surroundings

LOOK_INTERVAL = 0.05
"""s between looks at what is waited for."""


class MapUser(Component):
    """Follows map, odometry and scan; a subclass offers what is done with them."""

    ready_within = Parameter(5.0, "how long a goal waits for the first map and odometry", minimum=0.0, unit="s")
    least_memory = Parameter(
        FORGET_TIMEOUT,
        "for how long an obstacle is remembered at least where no scan looks: ten times as long as it was there",
        minimum=0.0,
        maximum=FORGET_TIMEOUT,
        unit="s",
        read_only=True,
    )
    obstacle_max_range = Parameter(
        100.0,
        "how far away an obstacle may be to be remembered: who is far away has often left before the robot comes",
        minimum=0.5,
        maximum=100.0,
        unit="m",
        read_only=True,
    )
    radius = robot_parameters.radius(read_only=True)
    turning_room = robot_parameters.turning_room(read_only=True)
    outline = robot_parameters.outline()

    odometry = Input(sensors.Odometry, latest_only=True, description="where the robot is and how it moves")
    scan = Input(sensors.LaserScan, latest_only=True, description="what is around")
    map = Input(maps.OccupancyGrid, latest_only=True, description="what stands still")

    @classmethod
    def parameters_for(cls, parameters: dict[str, Any]) -> Iterable[Parameter[Any]]:
        """Add none; raises ParameterError if the outline is none."""
        robot_parameters.check_outline(parameters["outline"])
        return ()

    def on_configure(self) -> None:
        """Begin without a map."""
        self._footprint = Footprint(*self.outline) if self.outline else Footprint.disc(self.radius)
        self._inflation = Inflation.of(self.radius, self.turning_room)
        self._surroundings = Surroundings(
            self._inflation, self._footprint.half_width, self.least_memory, self.obstacle_max_range
        )

    def _look(self) -> None:
        """Take in what has come."""
        try:
            self._surroundings.use_map(self.map.latest)
        except BadMap as error:
            self.kit.diagnose("map", Level.ERROR, str(error))
        self._surroundings.look(self.odometry.latest, self.scan.latest, self.kit.now(), self._oldest_scan())

    def _forget(self, request: ClearCostmap, area: Area) -> CostmapCleared:
        """Forget obstacles that were seen; raises RequestRefused."""
        self._look()
        return CostmapCleared(True, self._surroundings.forget(request, area))

    def _oldest_scan(self) -> float:
        """Return how old (s) a scan of use may be: of any age, unless the robot drives by it."""
        return math.inf

    async def _get_ready(self) -> None:
        """Wait for the first map and odometry; raises RequestRefused if they do not come."""
        deadline = self.kit.now() + self.ready_within
        self._look()
        while missing := self._surroundings.missing():
            if self.kit.now() >= deadline:
                raise RequestRefused(f"{missing} within {self.ready_within:g} s", RefusalCode.UNAVAILABLE)
            await self.kit.sleep(LOOK_INTERVAL)
            self._look()
