"""From pixels to places: how far away something of known height is, and whether it stands on the floor."""

from __future__ import annotations

import math
from dataclasses import dataclass

from bus_schema.messages.geometry import Pose, Quaternion
from services.detector.hydrant import Candidate
from services.detector.silhouette import FOOT_RADIUS, HEIGHT


@dataclass(frozen=True, slots=True)
class View:
    """A pinhole camera that looks along the floor.

    ``focal`` is the focal length in px, ``centre`` the (column, row) of the optical axis in px,
    ``above_floor`` the camera's height in m, ``pitch`` how far it looks down in rad.
    """

    focal: float
    centre: tuple[float, float]
    above_floor: float
    pitch: float

    @classmethod
    def of(cls, width: int, height: int, field_of_view: float, pose: Pose, base_height: float) -> View:
        """Return the view of a picture (px), its horizontal opening angle (rad) and its camera's pose.

        ``base_height`` is how far (m) above the floor the frame of the pose is.
        """
        focal = width / 2.0 / math.tan(field_of_view / 2.0)
        return cls(focal, (width / 2.0, height / 2.0), pose.position.z + base_height, _pitch(pose.orientation))

    def bearing(self, column: float) -> float:
        """Return the angle (rad, left is positive) at which a column (px) is seen."""
        return math.atan2(self.centre[0] - column, self.focal)

    def depth(self, candidate: Candidate) -> float:
        """Return how far (m) ahead the axis of a hydrant is, from how high it appears.

        Seen from above, the near edge of its foot appears lower than its axis stands, which counts as height.
        """
        depth = self.focal * HEIGHT / candidate.height
        for _ in range(3):
            shown = HEIGHT + FOOT_RADIUS * max(0.0, self.above_floor) / max(depth, FOOT_RADIUS)
            depth = self.focal * shown / candidate.height
        return depth

    def floor_error(self, candidate: Candidate) -> float:
        """Return how far a candidate is above or below where it should stand, as a share of its height."""
        near_edge = max(self.depth(candidate) - FOOT_RADIUS, FOOT_RADIUS)
        below_axis = math.atan2(self.above_floor, near_edge) - self.pitch
        floor_row = self.centre[1] + self.focal * math.tan(below_axis)
        return abs(candidate.bottom - floor_row) / candidate.height


def _pitch(rotation: Quaternion) -> float:
    """Return the rotation about y (rad), by which x points down."""
    sine = 2.0 * (rotation.w * rotation.y - rotation.z * rotation.x)
    return math.asin(max(-1.0, min(1.0, sine)))
