"""What every detector promises, whatever finds in it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft import CallFailed, Component, Output, every
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.geometry import Pose, Twist
from regraft.bus_schema.messages.health import Diagnostic, Level
from regraft.bus_schema.messages.perception import Detect, Sightings
from regraft.bus_schema.messages.power import EnergyUse
from regraft.bus_schema.messages.sensors import Image, Odometry
from regraft.bus_schema.model.lifecycle import Transition
from regraft.component.component import describe
from regraft.planar import Pose2D
from regraft.services.detector.detector import Detector
from regraft.services.detector.finder import Found
from regraft.services.detector.hydrant_detector import HydrantDetector
from regraft.services.detector.template_detector import TemplateDetector
from regraft.sim_service.cameras.renderers import RendererName
from regraft.testing import Rig
from tests.services.rigs import Studio, connect, set_parameters

HYDRANT = Pose2D(0.8, 0.1, 0.7)
BEFORE = Pose2D(-0.4, 0.0, 0.0)
Detecting = type[HydrantDetector]


class Theatre(Component):
    """Shows pictures, ten a second; the robot's poses come twice as often, if there are any."""

    image = Output(Image)
    odometry = Output(Odometry)

    def on_configure(self) -> None:
        self.pictures: list[Image] = []
        self.robot: Pose2D | None = None
        self.turning = 0.0

    @every(hz=20.0)
    def drive(self) -> None:
        if self.robot is not None:
            now = self.kit.now()
            pose = Pose.planar(self.robot.x, self.robot.y, self.robot.yaw + self.turning * now)
            self.odometry.publish(Odometry(now, "map", "base_link", pose, Twist()))

    @every(hz=10.0)
    def show(self) -> None:
        if self.pictures:
            self.image.publish(replace(self.pictures.pop(0), stamp=self.kit.now()))


@pytest.fixture(params=[Detector, TemplateDetector])
def detector(request: pytest.FixtureRequest) -> Detecting:
    cls: Detecting = request.param
    return cls


def set_up(rig: Rig, detector: Detecting, pictures: list[Image], robot: Pose2D | None = BEFORE) -> Theatre:
    rig.add(detector, "detector")
    theatre = rig.add(Theatre)
    theatre.pictures, theatre.robot = pictures, robot
    return theatre


def studio_of(renderer: RendererName, robot: Pose2D = BEFORE, camera: str = "camera") -> Studio:
    studio = Studio(renderer, camera, hydrant=HYDRANT, base=robot)
    studio.put_robot(robot.x, robot.y, robot.yaw)
    return studio


def ahead(distance: float) -> Pose2D:
    """Return a place that far before the hydrant."""
    return Pose2D(HYDRANT.x - distance, HYDRANT.y, 0.0)


def confidence(detector: Detecting, distance: float, light: float) -> float:
    studio = studio_of("ray", ahead(distance))
    with Rig() as rig:
        set_up(rig, detector, [studio.picture(light)], ahead(distance))
        best = rig.call("detect", Detect(), Sightings).best
    return best.confidence if best else 0.0


@pytest.mark.parametrize("distance", [0.5, 0.7, 1.2, 2.4])
def test_a_hydrant_is_placed_where_it_stands(detector: Detecting, renderer: RendererName, distance: float) -> None:
    robot = ahead(distance)
    studio = studio_of(renderer, robot)
    pictures = [studio.picture() for _ in range(3)]
    studio.close()
    with Rig() as rig:
        set_up(rig, detector, pictures, robot)
        seen = rig.call("detect", Detect(pictures=3), Sightings)
    assert (seen.pictures, seen.useful, seen.hits, seen.frame) == (3, 3, 3, "map")
    assert seen.position is not None
    assert math.hypot(seen.position.x - HYDRANT.x, seen.position.y - HYDRANT.y) < 0.15
    assert seen.spread is not None
    assert seen.spread < 0.1


def test_the_corner_camera_finds_it_all_over_the_room_at_no_cost(detector: Detecting, renderer: RendererName) -> None:
    for hydrant in (Pose2D(-0.8, -1.2, 0.0), Pose2D(0.3, 0.0, 1.0), Pose2D(1.5, 1.6, 2.0)):
        studio = Studio(renderer, "corner_camera", hydrant=hydrant, base=Pose2D(-1.5, 1.5, 0.0))
        picture = studio.picture(light=0.0)
        studio.close()
        with Rig() as rig:
            used = rig.collect("energy", EnergyUse)
            set_up(rig, detector, [picture], None)
            best = rig.call("detect", Detect(), Sightings).best
        assert best is not None
        assert best.frame == "map"
        assert math.hypot(best.position.x - hydrant.x, best.position.y - hydrant.y) < 0.3
        assert used == []


def test_the_pose_at_the_pictures_stamp_counts_not_the_latest(detector: Detecting) -> None:
    """The robot turns by 30 degrees a second; the picture is a quarter of a second old when it comes."""
    studio = studio_of("ray")
    with Rig() as rig:
        rig.add(detector, "detector")
        theatre = rig.add(Theatre)
        theatre.robot, theatre.turning = BEFORE, math.radians(30.0)
        rig.advance(2.0)
        then = rig.clock.now() / 1e9 - 0.27
        yaw = theatre.turning * then
        studio.put_robot(BEFORE.x, BEFORE.y, 0.0)
        late = replace(studio.picture(), stamp=then)
        rig.add(Late).picture = late
        seen = rig.call("detect", Detect(), Sightings)
    # The picture was taken facing along x, and said to be taken at ``then``: what it shows is turned by that yaw.
    assert seen.position is not None
    away = math.hypot(HYDRANT.x - BEFORE.x, HYDRANT.y - BEFORE.y)
    bearing = math.atan2(HYDRANT.y - BEFORE.y, HYDRANT.x - BEFORE.x) + yaw
    expected = (BEFORE.x + away * math.cos(bearing), BEFORE.y + away * math.sin(bearing))
    assert math.dist(expected, (seen.position.x, seen.position.y)) < 0.05


class Late(Component):
    """Shows one picture as it is, whenever it comes."""

    image = Output(Image)

    def on_configure(self) -> None:
        self.picture: Image | None = None

    @every(hz=10.0)
    def show(self) -> None:
        if self.picture is not None:
            self.image.publish(self.picture)
            self.picture = None


def test_without_a_pose_at_that_time_places_are_the_cameras(detector: Detecting) -> None:
    studio = studio_of("ray")
    with Rig() as rig:
        set_up(rig, detector, [studio.picture()], None)
        seen = rig.call("detect", Detect(), Sightings)
    assert seen.frame == "base_link"
    assert seen.position is not None
    assert math.dist((1.2, 0.1), (seen.position.x, seen.position.y)) < 0.06


def test_less_light_gives_less_confidence(detector: Detecting) -> None:
    bright, dim = confidence(detector, 1.2, 1.0), confidence(detector, 1.2, 0.6)
    assert 0.9 < bright <= 1.0
    assert 0.0 < dim < bright


@given(st.floats(0.7, 0.99), st.floats(0.1, 0.6), st.floats(0.4, 3.0), st.sampled_from(["likeness", "light", "depth"]))
def test_confidence_grows_with_light_nearness_and_a_better_shape(
    likeness: float, brightness: float, depth: float, what: str
) -> None:
    better = {"likeness": (likeness + 0.01, brightness, depth), "light": (likeness, brightness * 1.1, depth)}
    shape, light, ahead = better.get(what, (likeness, brightness, depth * 0.9))
    for cls in (Detector, TemplateDetector):
        less = cls.calibration.confidence(Found(likeness, 0.0, depth, 50.0, brightness))
        more = cls.calibration.confidence(Found(shape, 0.0, ahead, 50.0, light))
        assert 0.0 <= less <= more <= 1.0


def test_distractors_are_no_hydrants(detector: Detecting, renderer: RendererName) -> None:
    robot = Pose2D(-0.4, 0.0, 0.0)
    for yaw in (0.0, 0.4, 0.8):
        studio = Studio(renderer, red_box=Pose2D(0.6, 0.15, yaw), orange_ball=Pose2D(0.6, -0.15, 0.0), base=robot)
        studio.put_robot(robot.x, robot.y, robot.yaw)
        pictures = [studio.picture(light) for light in (1.0, 0.6, 0.3)]
        studio.close()
        with Rig() as rig:
            set_up(rig, detector, pictures, robot)
            assert rig.call("detect", Detect(pictures=3), Sightings).hits == 0


def test_the_same_pictures_give_the_same_answer(detector: Detecting) -> None:
    studio = studio_of("ray")
    pictures = [studio.picture(light) for light in (1.0, 0.7, 0.5)]
    answers = []
    for _ in range(2):
        with Rig() as rig:
            set_up(rig, detector, list(pictures))
            answers.append(rig.call("detect", Detect(pictures=3), Sightings))
    assert answers[0] == answers[1]


def test_in_the_black_of_night_nothing_is_found(detector: Detecting) -> None:
    studio = studio_of("ray")
    with Rig() as rig:
        set_up(rig, detector, [studio.picture(0.0) for _ in range(4)])
        seen = rig.call("detect", Detect(pictures=4), Sightings)
    assert (seen.pictures, seen.useful, seen.hits, seen.best, seen.position) == (4, 4, 0, None, None)


def test_black_and_frozen_pictures_are_told_and_of_no_use(detector: Detecting) -> None:
    studio = studio_of("ray")
    good = studio.picture()
    black = replace(good, pixels=np.zeros_like(good.pixels))
    with Rig() as rig:
        told: list[Diagnostic] = []
        rig.bus.subscribe(rig.keys.diagnostics, lambda sample: told.append(_diagnostic(sample.payload)))
        set_up(rig, detector, [good, good, good, black, black, studio.picture()])
        seen = rig.call("detect", Detect(pictures=6), Sightings)
        quality = rig.runtimes["detector"].component.evaluate()
    assert (seen.pictures, seen.useful, seen.hits) == (6, 2, 2)
    assert [one.level for one in told if one.subject == "image"] == [Level.ERROR, Level.ERROR, Level.OK]
    assert "frozen" in told[0].text
    assert "black" in told[1].text
    assert quality["pictures"] == 6
    assert quality["detection_rate"] == pytest.approx(2 / 6)


def rates_after_black_pictures(detector: Detecting, change: Callable[[Rig], None], topic: str = "image") -> list[float]:
    """Return the rates measured after black pictures, after a change, and after a good picture then."""
    good = studio_of("ray").picture()
    black = replace(good, pixels=np.zeros_like(good.pixels))
    measured = []
    with Rig() as rig:
        theatre = set_up(rig, detector, [black] * 3)
        rig.add(Theatre, "other", connections={"image": "other/image", "odometry": None}).pictures = []
        rig.call("detect", Detect(pictures=3), Sightings)
        component = rig.runtimes["detector"].component
        measured.append(component.evaluate().get("useful_rate", math.nan))
        change(rig)
        measured.append(component.evaluate().get("useful_rate", math.nan))
        other = rig.runtimes["other"].component
        assert isinstance(other, Theatre)
        (theatre if topic == "image" else other).pictures = [good]
        rig.call("detect", Detect(pictures=1), Sightings)
        measured.append(component.evaluate()["useful_rate"])
    return measured


def test_rates_are_those_of_the_camera_that_is_connected(detector: Detecting) -> None:
    rates = rates_after_black_pictures(
        detector, lambda rig: connect(rig, "detector", "image", "other/image"), "other/image"
    )
    assert rates == pytest.approx([0.0, math.nan, 1.0], nan_ok=True)


def test_rates_begin_anew_with_another_way_to_look_alone(detector: Detecting) -> None:
    rates = rates_after_black_pictures(detector, lambda rig: set_parameters(rig, "detector", farthest=6.0))
    assert rates == pytest.approx([0.0, math.nan, 1.0], nan_ok=True)
    rates = rates_after_black_pictures(
        detector, lambda rig: set_parameters(rig, "detector", pictures=2, picture_energy=1.0)
    )
    assert rates == pytest.approx([0.0, 0.0, 1 / 4])


def test_rates_begin_anew_after_an_inactive_time(detector: Detecting) -> None:
    def rest(rig: Rig) -> None:
        rig.transition("detector", Transition.DEACTIVATE)
        rig.transition("detector", Transition.ACTIVATE)

    assert rates_after_black_pictures(detector, rest) == pytest.approx([0.0, math.nan, 1.0], nan_ok=True)


def test_rates_begin_anew_with_a_picture_from_another_camera(detector: Detecting) -> None:
    own, corner = studio_of("ray").picture(), studio_of("ray", camera="corner_camera").picture()
    with Rig() as rig:
        set_up(rig, detector, [replace(own, pixels=np.zeros_like(own.pixels)), corner])
        rig.call("detect", Detect(pictures=2), Sightings)
        assert rig.runtimes["detector"].component.evaluate()["useful_rate"] == 1.0


def test_pictures_without_pixels_are_told_and_of_no_use(detector: Detecting) -> None:
    good = studio_of("ray").picture()
    empty = replace(good, pixels=np.empty((0, 0, 3), np.uint8))
    with Rig() as rig:
        told: list[Diagnostic] = []
        rig.bus.subscribe(rig.keys.diagnostics, lambda sample: told.append(_diagnostic(sample.payload)))
        set_up(rig, detector, [empty, empty, good])
        seen = rig.call("detect", Detect(pictures=3), Sightings)
    assert (seen.pictures, seen.useful, seen.hits) == (3, 1, 1)
    assert [one.level for one in told if one.subject == "image"] == [Level.ERROR, Level.OK]


def test_a_missing_picture_is_told_until_one_comes(detector: Detecting) -> None:
    studio = studio_of("ray")
    with Rig() as rig:
        told: list[Diagnostic] = []
        rig.bus.subscribe(rig.keys.diagnostics, lambda sample: told.append(_diagnostic(sample.payload)))
        theatre = set_up(rig, detector, [])
        with pytest.raises(CallFailed, match="no picture within 5 s"):
            rig.call("detect", Detect(), Sightings, timeout=10.0)
        theatre.pictures = [studio.picture()]
        assert rig.call("detect", Detect(), Sightings).hits == 1
    assert [one.level for one in told if one.subject == "image"] == [Level.ERROR, Level.OK]


def test_its_ports_and_services_are_those_of_every_detector(detector: Detecting) -> None:
    own, common = describe(detector), describe(Detector)
    assert own.ports == common.ports
    assert own.services == common.services
    assert own.resources.cpu > 0.0


def test_an_estimate_tells_what_a_request_gives_and_takes(detector: Detecting) -> None:
    day = detector.estimate({"pictures": 3, "interval": 1.0}, {"darkness": 0.0})
    dusk = detector.estimate({"pictures": 3, "interval": 1.0}, {"darkness": 0.5, "in_view": 0.25})
    corner = detector.estimate({}, {"darkness": 1.0, "on_board": False})
    energy = detector.picture_energy.default
    assert day["detection_rate"] > 0.9
    assert day["hits_per_request"] == pytest.approx(3 * day["detection_rate"])
    assert day["energy_per_request"] == pytest.approx(3 * energy)
    assert day["power"] == pytest.approx(energy)
    assert 0.0 < dusk["detection_rate"] < 0.25
    assert corner["detection_rate"] == pytest.approx(day["detection_rate"])
    assert corner["energy_per_request"] == corner["power"] == 0.0


def _diagnostic(payload: bytes) -> Diagnostic:
    return codec.decode(payload, Diagnostic)
