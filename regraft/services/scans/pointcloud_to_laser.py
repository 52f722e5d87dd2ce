"""Makes laser scans out of the images of a depth camera."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

from regraft import Input, Level, Output, Parameter, ParameterError
from regraft.bus_schema.messages.geometry import Pose, Quaternion, Vector3
from regraft.bus_schema.messages.sensors import DepthImage, LaserScan
from regraft.bus_schema.model.description import Resources
from regraft.bus_schema.model.robots.scopes import in_scope
from regraft.services import robot_parameters
from regraft.services.scans.depth_scan import BadView, DepthScan, View, axes_of
from regraft.services.scans.powered import PoweredComponent

BASE_FRAME = "base_link"


class PointcloudToLaser(PoweredComponent):
    """Publishes a level scan for each depth image of a camera on the robot: of what stands in a band of heights.

    It does what ROS's pointcloud_to_laserscan does. A beam has the planar distance to its nearest point, from the
    camera's place. It is +inf where no point is found within the camera's reach. It is -inf where something is nearer
    than the camera measures (REP 117). The scan has the camera's field of view and nothing beyond.
    """

    resources = Resources(cpu=0.02, memory=25.0)

    beams = Parameter(0, "of a scan; 0: as many as the image has columns", minimum=0, maximum=3600, read_only=True)
    min_height = Parameter(0.05, "of the lowest points that count, above the floor", minimum=0.0, unit="m")
    max_height = Parameter(1.0, "of the highest points that count, above the floor", minimum=0.0, unit="m")
    power = robot_parameters.depth_camera_power()
    base_height = robot_parameters.base_height()

    depth = Input(DepthImage, latest_only=True, description="the depths that the camera on the robot sees")
    scan = Output(LaserScan, description="the nearest points by their bearing")

    @classmethod
    def check_parameters(cls, parameters: dict[str, Any], seed: int) -> None:
        """Refuse a band of heights that is empty."""
        _check_band(parameters["min_height"], parameters["max_height"])

    def on_configure(self) -> None:
        """Begin without a view; raises ParameterError."""
        _check_band(self.min_height, self.max_height)
        self._known: tuple[Hashable, DepthScan | None] | None = None

    def on_parameters(self, changed: frozenset[str]) -> None:
        """Refuse a band of heights that is empty; raises ParameterError."""
        _check_band(self.min_height, self.max_height)

    @depth.handler
    def on_depth(self, image: DepthImage) -> None:
        """Publish the scan of an image."""
        projection = self._projection(image)
        if projection is None:
            return
        self.scan.publish(
            LaserScan(
                image.stamp,
                f"{image.frame.removesuffix('_optical')}_scan",
                image.pose_frame,
                _level(image.pose),
                projection.angle_min,
                projection.angle_increment,
                image.range_min,
                image.range_max,
                projection.ranges(image.depths),
            )
        )

    def _projection(self, image: DepthImage) -> DepthScan | None:
        """Return what makes scans of such images, prepared once for each view; None if that is not possible."""
        band, reach = (self.min_height, self.max_height), (image.range_min, image.range_max)
        size, opening = image.depths.shape, image.horizontal_field_of_view
        key = (image.pose_frame, image.pose, self.base_height, size, opening, band, reach)
        if self._known is None or self._known[0] != key:
            self._known = (key, self._prepared(image, band, reach))
        return self._known[1]

    def _prepared(self, image: DepthImage, band: tuple[float, float], reach: tuple[float, float]) -> DepthScan | None:
        try:
            found = DepthScan(self._view(image), self.beams, band, reach)
        except BadView as error:
            self.kit.diagnose("camera", Level.ERROR, f"no scans can be made: {error}")
            return None
        self.kit.diagnose("camera", Level.OK, f"scans of {found.beams} beams are made")
        return found

    def _view(self, image: DepthImage) -> View:
        """Return the view of an image's camera; raises BadView."""
        base = in_scope(self.kit.scope, BASE_FRAME)
        if image.pose_frame != base:
            raise BadView(f"the camera must be on the robot, at {base!r}, but it is at {image.pose_frame!r}")
        height, width = image.depths.shape
        if not height or not width:
            raise BadView(f"the images must have pixels, but they have {height} rows and {width} columns")
        turned, above = image.pose.orientation, image.pose.position.z + self.base_height
        axes = axes_of(turned.x, turned.y, turned.z, turned.w)
        return View(axes, above, image.horizontal_field_of_view, (height, width))


def _check_band(lowest: float, highest: float) -> None:
    if lowest >= highest:
        raise ParameterError([("max_height", f"{highest:g} m: must be above min_height, {lowest:g} m")])


def _level(pose: Pose) -> Pose:
    """Return a camera's pose without its tilt."""
    place = pose.position
    return Pose(Vector3(place.x, place.y, place.z), Quaternion.from_yaw(pose.yaw))
