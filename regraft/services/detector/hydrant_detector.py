"""The base of all detectors of hydrants: the service ``detect``, and all but the finder."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections import deque
from dataclasses import replace
from typing import ClassVar

import cv2

from regraft import Component, Input, Output, Parameter, Quality, RefusalCode, RequestRefused, service
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.geometry import Pose, Vector3
from regraft.bus_schema.messages.health import Level
from regraft.bus_schema.messages.perception import Detect, Detection, Detections, Sightings
from regraft.bus_schema.messages.power import EnergyUse
from regraft.bus_schema.messages.sensors import Image, Odometry
from regraft.bus_schema.model.robots.scopes import in_scope
from regraft.component.component import InputQualities
from regraft.services import robot_parameters
from regraft.services.detector.confidence import Calibration
from regraft.services.detector.finder import Finder, Found
from regraft.services.detector.location import MAP_FRAME, locate
from regraft.services.detector.performance import Performance
from regraft.services.detector.picture_check import fault_of
from regraft.services.detector.pose_history import KEPT, PoseHistory
from regraft.services.detector.view import View
from regraft.services.power_model import PICTURE_ENERGY
from regraft.services.sensor_checks import SILENT, Finding

LABEL = "hydrant"
BASE_FRAME = "base_link"
RECENT = 20
"""Pictures over which the hit rate is taken."""
LOOKS_ALIKE = frozenset({"pictures", "interval", "picture_within", "picture_energy"})
"""Parameters that make no difference to what a picture shows."""


class NoPictureError(Exception):
    """No picture came in time."""


class HydrantDetector(Component):
    """Looks for a fire hydrant in pictures when asked, and reports where it is.

    Each picture from the on-board camera takes energy from the robot's battery; pictures of a camera that does not
    ride on the robot take nothing of it. Places are given in the map, for which the robot's pose at the time of the
    picture is taken; where that is not known, in the camera's frame. The subclass has the finder.
    """

    calibration: ClassVar[Calibration]
    performance: ClassVar[Performance]

    pictures = Parameter(1, "pictures for a request without a number", minimum=1, maximum=100)
    interval = Parameter(0.0, "pause before each picture", minimum=0.0, maximum=60.0, unit="s")
    picture_within = Parameter(5.0, "how long a picture is waited for", minimum=0.1, maximum=60.0, unit="s")
    picture_energy = Parameter(PICTURE_ENERGY, "for one on-board picture", minimum=0.0, unit="J")
    base_height = robot_parameters.base_height()
    farthest = Parameter(7.0, "what seems farther is a speck of noise", minimum=0.5, maximum=100.0, unit="m")

    detection_rate = Quality(
        "share of the pictures with a hit", better="higher", minimum=0.0, maximum=1.0, functional=True
    )
    useful_rate = Quality(
        "share of the pictures without a fault", better="higher", minimum=0.0, maximum=1.0, estimated=False
    )
    pictures_taken = Quality("that were looked at", minimum=0.0, estimated=False, name="pictures")
    hits_per_request = Quality("as expected", better="higher", minimum=0.0, functional=True, measured=False)
    energy_per_request = Quality("of the robot's", unit="J", better="lower", minimum=0.0, measured=False)
    power = Quality("if one request follows another", unit="W", better="lower", minimum=0.0, measured=False)
    time_per_request = Quality("until the reply", unit="s", better="lower", minimum=0.0, measured=False)
    cpu_per_request = Quality("of one core", unit="s", better="lower", minimum=0.0, measured=False)

    image = Input(Image, latest_only=True, on_demand=True, description="where to look")
    odometry = Input(Odometry, keep=KEPT, required=False, description="where robot and camera are in the map")
    detections = Output(Detections, description="what each picture shows that was looked at")
    energy = Output(EnergyUse, description="what an on-board picture takes")

    def __init__(self) -> None:
        self._recent: deque[tuple[bool, bool]] = deque(maxlen=RECENT)
        self._camera: tuple[str, ...] = ()

    @abstractmethod
    def finder(self) -> Finder:
        """Return what finds hydrants, as the parameters now are."""

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        """Return what a request would give and take; see ``Performance.estimate``."""
        known: dict[str, PlainValue] = {
            "pictures": cls.pictures.default,
            "interval": cls.interval.default,
            "picture_energy": cls.picture_energy.default,
        }
        return cls.performance.estimate({**known, **parameters}, context)

    @classmethod
    def estimate_from_inputs(
        cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue], inputs: InputQualities
    ) -> dict[str, float]:
        """Return the same at the rate of the camera that is connected, unless the context gives one."""
        rate = inputs.get("image", {}).get("rate", 0.0)
        return cls.estimate(parameters, {"camera_rate": rate, **context} if rate > 0.0 else context)

    def evaluate(self) -> dict[str, float]:
        """Return how many ``pictures`` were looked at, and rates (0 to 1) of the last 20.

        ``detection_rate`` is the share with a hit, wherever the hydrant was, ``useful_rate`` that without a fault. Both
        are of pictures from the present camera alone, that were looked at as now.
        """
        rates = {"pictures": float(self._taken)}
        if self._recent and self._camera[0] == self.image.key:
            rates["detection_rate"] = sum(hit for _, hit in self._recent) / len(self._recent)
            rates["useful_rate"] = sum(useful for useful, _ in self._recent) / len(self._recent)
        return rates

    def on_configure(self) -> None:
        """Leave the other cores to the other components."""
        cv2.setNumThreads(1)
        self._seen: tuple[Image, Detections, bool] | None = None
        self._poses = PoseHistory()
        self._taken = 0
        self._fault = ""

    def on_activate(self) -> None:
        """Measure from now on."""
        self._recent.clear()

    def on_parameters(self, changed: frozenset[str]) -> None:
        """Begin to measure once more where other values find something else."""
        if changed - LOOKS_ALIKE:
            self._recent.clear()

    @service("detect")
    async def detect(self, request: Detect) -> Sightings:
        """Look for a hydrant in the next pictures."""
        if request.label != LABEL:
            why = f"this detector finds {LABEL!r} only, not {request.label!r}"
            raise RequestRefused(why, RefusalCode.INVALID, field="label")
        looked = useful = paid = 0
        hits: list[Detection] = []
        for _ in range(request.pictures or self.pictures):
            if self.interval > 0.0:
                await self.kit.sleep(self.interval)
            before = self.image.latest
            try:
                image = await self._next_picture()
            except NoPictureError as error:
                self._diagnose(Finding(SILENT, str(error)))
                if looked == 0:
                    raise RequestRefused(str(error), RefusalCode.UNAVAILABLE) from None
                break
            found, of_use, is_paid = self._look(image, before)
            looked, useful, paid = looked + 1, useful + of_use, paid + is_paid
            hits += found.objects[:1]
        seen = Sightings(looked, 0, useful=useful, paid=paid, picture_energy=self.picture_energy)
        place = locate(hits)
        if place is None:
            return seen
        best = max(hits, key=lambda hit: hit.confidence)
        located = replace(seen, position=place.position, frame=place.frame, spread=place.spread)
        return replace(located, hits=len(hits), best=best)

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

    def _look(self, image: Image, before: Image | None) -> tuple[Detections, bool, bool]:
        """Look at a picture, once for all requests; also return whether it was of use, and took energy now."""
        if self._seen is not None and self._seen[0] is image:
            return self._seen[1], self._seen[2], False
        fault = fault_of(image, before)
        self._diagnose(fault)
        objects = () if fault else self._objects(image)
        found = Detections(image.stamp, image.frame.removesuffix("_optical"), objects)
        self._seen = (image, found, not fault)
        self._taken += 1
        camera = (self.image.key, image.pose_frame, image.frame)
        if camera != self._camera:
            self._camera = camera
            self._recent.clear()
        self._recent.append((not fault, bool(objects)))
        self.detections.publish(found)
        is_paid = self._is_on_board(image)
        if is_paid:
            self.energy.publish(EnergyUse(image.stamp, self.kit.name, self.picture_energy))
        return found, not fault, is_paid

    def _is_on_board(self, image: Image) -> bool:
        return image.pose_frame == in_scope(self.kit.scope, BASE_FRAME)

    def _diagnose(self, finding: Finding | None) -> None:
        """Report when something begins to be wrong with the pictures, and when that is over."""
        fault = finding.fault if finding else ""
        if fault == self._fault:
            return
        self._fault = fault
        if finding:
            self.kit.diagnose("image", finding.level, finding.text)
        else:
            self.kit.diagnose("image", Level.OK, "the pictures are of use again")

    def _objects(self, image: Image) -> tuple[Detection, ...]:
        height, width, _ = image.pixels.shape
        base_height = self.base_height if self._is_on_board(image) else 0.0
        view = View.of(width, height, image.horizontal_field_of_view, image.pose, base_height)
        frame, camera = self._camera_pose(image)
        return tuple(
            self._place(found, view, frame, camera)
            for found in self.finder().find(image.pixels, view)
            if found.depth <= self.farthest
        )

    def _place(self, found: Found, view: View, frame: str, camera: Pose) -> Detection:
        bearing = view.bearing(found.axis)
        distance = found.depth / math.cos(bearing)
        direction = camera.yaw + bearing
        position = Vector3(camera.x + distance * math.cos(direction), camera.y + distance * math.sin(direction), 0.0)
        return Detection(LABEL, self.calibration.confidence(found), frame, position, bearing, distance)

    def _camera_pose(self, image: Image) -> tuple[str, Pose]:
        """Return where the camera was, seen from above, and in which frame: the map, if that is known."""
        self._poses.add(self.odometry.take())
        base = self._poses.at(image.stamp) if self._is_on_board(image) else None
        if base is None:
            return image.pose_frame, image.pose
        mount = image.pose
        cos, sin = math.cos(base.yaw), math.sin(base.yaw)
        x, y = base.x + cos * mount.x - sin * mount.y, base.y + sin * mount.x + cos * mount.y
        return MAP_FRAME, Pose.planar(x, y, base.yaw + mount.yaw)
