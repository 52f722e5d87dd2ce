"""The cheap mapper: it trusts the odometry."""

from __future__ import annotations

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.description import Resources
from regraft.services.mapper import estimates
from regraft.services.mapper.component import MappingComponent
from regraft.services.mapper.matching.localizer import Localizer, TrustingLocalizer


class OdometryMapper(MappingComponent):
    """Maps what the lidar sees from where the odometry states that the robot is.

    It takes about half the time of the matching mapper. Its map is as good as the odometry: it smears with the
    drift, which it cannot notice.
    """

    resources = Resources(cpu=0.03, memory=25.0)

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        """Return ``cpu`` (share of a core), ``pose_error`` (m) and ``map_quality`` (0 to 1); see `estimates`."""
        resolution = float(parameters.get("resolution", cls.resolution.default))
        separation = float(parameters.get("wheel_separation", cls.wheel_separation.default))
        return estimates.of_odometry(resolution, separation, context)

    def localizer(self) -> Localizer:
        """Return what believes the odometry."""
        return TrustingLocalizer()
