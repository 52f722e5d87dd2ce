"""From pixels to places: how far away something of known height is, and whether it stands on the floor."""

from __future__ import annotations

import math
from dataclasses import dataclass

from regraft.bus_schema.messages.geometry import Pose, Quaternion
from regraft.services.detector.hydrant import Candidate
from regraft.services.detector.silhouette import FOOT_RADIUS, HEIGHT


@dataclass(frozen=True, slots=True)
class View:
    """A pinhole camera that looks along the floor.

    ``focal`` is the focal length in px, ``centre`` the (column, row) of the optical axis in px. ``above_floor`` is the
    camera's height in m, ``pitch`` how far it looks down in rad.
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
        for _ in range(5):
            depth *= self.shown_height(depth) / candidate.height
        return depth

    def depth_on_floor(self, row: float) -> float:
        """Return how far (m) ahead the axis of a hydrant is whose foot's near edge appears at a row; inf: nowhere."""
        down = math.atan2(row - self.centre[1], self.focal) + self.pitch
        return math.inf if down <= 0.0 else self.above_floor / math.tan(down) + FOOT_RADIUS

    def floor_error(self, candidate: Candidate) -> float:
        """Return how far a candidate is above or below where it should stand, as a share of its height."""
        return abs(candidate.bottom - self.foot_row(self.depth(candidate))) / candidate.height

    def foot_row(self, depth: float) -> float:
        """Return the row (px) of the near edge of a hydrant's foot whose axis is so far (m) ahead."""
        near_edge = max(depth - FOOT_RADIUS, FOOT_RADIUS)
        return self.centre[1] + self.focal * math.tan(math.atan2(self.above_floor, near_edge) - self.pitch)

    def shown_height(self, depth: float) -> float:
        """Return how many rows (px) a hydrant covers whose axis is so far (m) ahead."""
        top = self.centre[1] + self.focal * math.tan(math.atan2(self.above_floor - HEIGHT, depth) - self.pitch)
        return self.foot_row(depth) - top


def _pitch(rotation: Quaternion) -> float:
    """Return the rotation about y (rad), by which x points down."""
    sine = 2.0 * (rotation.w * rotation.y - rotation.z * rotation.x)
    return math.asin(max(-1.0, min(1.0, sine)))
