"""The detector: the service ``detect`` as a component."""

from __future__ import annotations

import math

import cv2

from bus_schema.annotations import PlainValue
from bus_schema.messages.geometry import Pose, Vector3
from bus_schema.messages.perception import Detect, Detection, Detections, Sightings
from bus_schema.messages.power import EnergyUse
from bus_schema.messages.sensors import Image, Odometry
from regraft import Component, Input, Output, Parameter, RequestRefused, service
from services.detector.hydrant import Candidate, Thresholds, find_hydrant
from services.detector.view import View
from services.power_model import PICTURE_ENERGY

LABEL = "hydrant"
MAP_FRAME = "map"
BASE_FRAME = "base_link"
NEAR_ENOUGH = 0.08
"""How far a hydrant may seem off the floor, as a share of its height: rendered ones were at most 0.06 off."""


class NoPictureError(Exception):
    """No picture came in time."""


class Detector(Component):
    """Looks for a fire hydrant in pictures when asked, and tells where it stands.

    Each picture from the on-board camera takes 59.275 J of the robot's battery; pictures of a camera that
    does not ride on the robot take nothing of it. Places are given in the map, for which the odometry is
    taken.
    """

    pictures = Parameter(1, "pictures for a request that does not say how many", minimum=1, maximum=100)
    interval = Parameter(0.0, "pause before each picture", minimum=0.0, maximum=60.0, unit="s")
    picture_within = Parameter(5.0, "how long a picture is waited for", minimum=0.1, maximum=60.0, unit="s")
    picture_energy = Parameter(PICTURE_ENERGY, "for one on-board picture", minimum=0.0, unit="J")
    base_height = Parameter(0.033, "of base_link above the floor", minimum=0.0, unit="m")
    saturation = Parameter(110, "least saturation of a hydrant's pixel", minimum=0, maximum=255)
    brightness = Parameter(45, "least brightness of a hydrant's pixel", minimum=0, maximum=255)
    score = Parameter(0.75, "least likeness to a hydrant's outline", minimum=0.0, maximum=1.0)
    farthest = Parameter(7.0, "what seems farther is a speck of noise", minimum=0.5, unit="m")

    image = Input(Image, latest_only=True, text="where to look")
    odometry = Input(Odometry, latest_only=True, required=False, text="where the robot, and so its camera, is")
    detections = Output(Detections, text="what each picture shows that was looked at")
    energy = Output(EnergyUse, text="what an on-board picture takes")

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        """Return the energy (J) that a request takes with the on-board camera."""
        pictures = float(parameters.get("pictures", cls.pictures.default))
        return {"energy_per_request": pictures * float(parameters.get("picture_energy", PICTURE_ENERGY))}

    def on_configure(self) -> None:
        """Leave the other cores to the other components."""
        cv2.setNumThreads(1)
        self._seen: tuple[Image, Detections] | None = None

    @service("detect")
    async def detect(self, request: Detect) -> Sightings:
        """Look for a hydrant in the next pictures."""
        if request.label != LABEL:
            raise RequestRefused(f"this detector finds {LABEL!r} only, not {request.label!r}")
        looked = hits = 0
        best: Detection | None = None
        for _ in range(request.pictures or self.pictures):
            if self.interval > 0.0:
                await self.kit.sleep(self.interval)
            try:
                image = await self._next_picture()
            except NoPictureError as error:
                if looked == 0:
                    raise RequestRefused(str(error)) from None
                break
            found = self._look(image).objects
            looked, hits = looked + 1, hits + bool(found)
            if found and (best is None or found[0].confidence > best.confidence):
                best = found[0]
        return Sightings(looked, hits, best)

    async def _next_picture(self) -> Image:
        coming, within = self.image.next(), self.picture_within

        async def expire() -> None:
            await self.kit.sleep(within)
            coming.fail(NoPictureError(f"no picture within {within:g} s: is the camera active that 'image' is fed by?"))

        expiry = self.kit.spawn(expire(), "wait for a picture")
        try:
            return await coming
        finally:
            expiry.cancel()

    def _look(self, image: Image) -> Detections:
        """Look at a picture, once, whoever has asked for it."""
        if self._seen is not None and self._seen[0] is image:
            return self._seen[1]
        on_board = image.pose_frame == BASE_FRAME
        height, width, _ = image.pixels.shape
        base_height = self.base_height if on_board else 0.0
        view = View.of(width, height, image.horizontal_field_of_view, image.pose, base_height)
        thresholds = Thresholds(self.saturation, self.brightness, score=self.score)
        objects = tuple(
            self._place(image, view, candidate)
            for candidate in find_hydrant(image.pixels, thresholds)
            if view.floor_error(candidate) <= NEAR_ENOUGH and view.depth(candidate) <= self.farthest
        )
        found = Detections(image.stamp, image.frame.removesuffix("_optical"), objects)
        self._seen = (image, found)
        self.detections.publish(found)
        if on_board:
            self.energy.publish(EnergyUse(image.stamp, self.kit.name, self.picture_energy))
        return found

    def _place(self, image: Image, view: View, candidate: Candidate) -> Detection:
        bearing = view.bearing(candidate.axis)
        distance = view.depth(candidate) / math.cos(bearing)
        frame, camera = self._camera_pose(image)
        direction = camera.yaw + bearing
        position = Vector3(camera.x + distance * math.cos(direction), camera.y + distance * math.sin(direction), 0.0)
        return Detection(LABEL, candidate.score, frame, position, bearing, distance)

    def _camera_pose(self, image: Image) -> tuple[str, Pose]:
        """Return where the camera is, seen from above, and in which frame: the map, if that is known."""
        odometry = self.odometry.latest
        if image.pose_frame != BASE_FRAME or odometry is None:
            return image.pose_frame, image.pose
        base, mount = odometry.pose, image.pose
        cos, sin = math.cos(base.yaw), math.sin(base.yaw)
        x, y = base.x + cos * mount.x - sin * mount.y, base.y + sin * mount.x + cos * mount.y
        return MAP_FRAME, Pose.planar(x, y, base.yaw + mount.yaw)
