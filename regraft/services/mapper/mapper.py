"""The mapper: corrects the odometry by matching scans with the map."""

from __future__ import annotations

import math

from regraft import Parameter, Quality, every
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.health import Level
from regraft.bus_schema.messages.sensors import LaserScan, Odometry
from regraft.bus_schema.model.description import Resources
from regraft.services.mapper import estimates
from regraft.services.mapper.component import MappingComponent
from regraft.services.mapper.drift import WINDOW
from regraft.services.mapper.fit_watch import FitWatch
from regraft.services.mapper.matching.localizer import Limits, MatchingLocalizer


class Mapper(MappingComponent):
    """Maps what the lidar sees, and corrects the odometry by matching each scan with the map.

    A scan that fits the map nowhere near is not written into it. When that continues, the robot is lost: somebody
    lifted it away, or its surroundings changed. It then searches the map for the one place where the scan fits.
    """

    resources = Resources(cpu=0.04, memory=25.0)

    least_ratio = Parameter(
        0.6, "share of the echoes on known ground that must fit the map for a correction", minimum=0.1, maximum=1.0
    )
    largest_correction = Parameter(
        0.25, "how far one scan may move the pose without a search", minimum=0.01, maximum=1.0, unit="m"
    )
    largest_turn = Parameter(
        0.35, "how far one scan may turn the pose without a search", minimum=0.01, maximum=1.0, unit="rad"
    )

    correction = Quality("mean of the last half minute", unit="m", better="lower", minimum=0.0, estimated=False)
    inlier_ratio = Quality(
        "share of the last scan that fits the map", better="higher", minimum=0.0, maximum=1.0, estimated=False
    )

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        """Return ``cpu`` (share of a core), ``pose_error`` (m) and ``map_quality`` (0 to 1); see `estimates`."""
        return estimates.of_matching(float(parameters.get("resolution", cls.resolution.default)), context)

    def localizer(self) -> MatchingLocalizer:
        """Return what matches scans with the map."""
        localizer = MatchingLocalizer()
        localizer.limits = Limits(self.least_ratio, self.largest_correction, self.largest_turn)
        return localizer

    def on_configure(self) -> None:
        """Begin without a map."""
        super().on_configure()
        self._fit_watch = FitWatch(self.kit, self.mapping, self.troubles)

    def on_activate(self) -> None:
        """Begin to look around."""
        super().on_activate()
        self._fit_watch.start()

    def on_parameters(self, changed: frozenset[str]) -> None:
        """Take over what a match must be like."""
        if hasattr(self, "mapping"):
            self.mapping.localizer.limits = Limits(self.least_ratio, self.largest_correction, self.largest_turn)

    def on_odometry(self, message: Odometry) -> None:
        """Publish the pose in the map; a scan that waited for this odometry may show that the robot is lost."""
        super().on_odometry(message)
        self._fit_watch.look()

    def on_scan(self, message: LaserScan) -> None:
        """Correct the pose and write the scan into the map; search when lost."""
        super().on_scan(message)
        self._fit_watch.look()

    @every(hz=0.5)
    def tell_drift(self) -> None:
        """Return how much the odometry drifts, when it is much."""
        drift = self.mapping.drift.drift
        wrong = Level.WARNING if self.mapping.drift.drifting else None
        loss = f"{drift.distance:.2f} m and {math.degrees(drift.turn):.1f} degrees in the last {WINDOW:g} s"
        text = f"the odometry drifts: {loss}" if wrong else f"the odometry no longer drifts much: {loss}"
        values = {"forward": drift.forward, "left": drift.left, "turn": drift.turn, "window": WINDOW}
        self.troubles.note("drift", wrong, text, self.kit.now(), **values)

    def evaluate(self) -> dict[str, float]:
        """Return the known ground (m²), the mean correction of the last half minute (m), and the inlier ratio."""
        ratio = self.mapping.inlier_ratio
        measured = {"inlier_ratio": ratio} if ratio is not None else {}
        return super().evaluate() | {"correction": self.mapping.drift.mean_correction} | measured
