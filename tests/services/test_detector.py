"""Promises of the detector, with real pictures."""

import math
from dataclasses import replace

import numpy as np
import pytest

from regraft import CallFailed, Component, Output, every
from regraft.bus_schema.messages.geometry import Pose, Twist
from regraft.bus_schema.messages.perception import Detect, Detection, Detections, Sightings
from regraft.bus_schema.messages.power import EnergyUse
from regraft.bus_schema.messages.sensors import Image, Odometry
from regraft.bus_schema.model.lifecycle import Transition
from regraft.planar import Pose2D
from regraft.services.detector.detector import Detector
from regraft.sim_service import survey
from regraft.sim_service.cameras.renderers import RendererName
from regraft.sim_service.layout.placement import draw_placement
from regraft.sim_service.simulation import Simulation
from regraft.testing import Rig
from tests.support.worlds import frog_scene

from .rigs import Studio

WRONG = 0.3
"""m: a sighting farther from the hydrant than this saw something else."""
BEFORE = Pose2D(-0.4, 0.0, 0.0)


class Projector(Component):
    """Shows pictures, five a second, as long as there are some, of a robot that stands still."""

    image = Output(Image)
    odometry = Output(Odometry)

    def on_configure(self) -> None:
        self.pictures: list[Image] = []
        self.robot: Pose2D | None = None

    @every(hz=5.0)
    def show(self) -> None:
        now = self.kit.now()
        if self.robot is not None:
            pose = Pose.planar(self.robot.x, self.robot.y, self.robot.yaw)
            self.odometry.publish(Odometry(now, "map", "base_link", pose, Twist()))
        if self.pictures:
            self.image.publish(replace(self.pictures.pop(0), stamp=now))


def set_up(rig: Rig, shown: list[Image], robot: Pose2D = BEFORE, **parameters: object) -> None:
    """Put a detector before some pictures."""
    rig.add(Detector, parameters=parameters)
    projector = rig.add(Projector)
    projector.pictures, projector.robot = shown, robot


def look(studio: Studio, robot: Pose2D = BEFORE, light: float = 1.0) -> Detection | None:
    """Return what the detector finds in one picture, taken by a robot at a pose."""
    studio.put_robot(robot.x, robot.y, robot.yaw)
    with Rig() as rig:
        set_up(rig, [studio.picture(light)], robot)
        return rig.call("detect", Detect(), Sightings).best


def before_hydrant(renderer: RendererName, camera: str = "camera") -> Studio:
    return Studio(renderer, camera, hydrant=Pose2D(0.8, 0.1, 0.7), base=BEFORE)


def off(sighting: Detection, x: float, y: float) -> float:
    return math.hypot(sighting.position.x - x, sighting.position.y - y)


def test_a_hydrant_ahead_is_found_where_it_stands(renderer: RendererName) -> None:
    sighting = look(before_hydrant(renderer))
    assert sighting is not None
    assert sighting.frame == "map"
    assert off(sighting, 0.8, 0.1) < 0.06
    assert sighting.bearing > 0.0
    assert sighting.distance == pytest.approx(1.13, abs=0.06)
    assert sighting.confidence > 0.85


@pytest.mark.parametrize("robot", [Pose2D(0.8, -1.2, math.pi / 2), Pose2D(-1.7, 0.1, 0.0), Pose2D(1.9, -0.6, 2.5)])
def test_it_is_found_from_all_sides(renderer: RendererName, robot: Pose2D) -> None:
    sighting = look(before_hydrant(renderer), robot)
    assert sighting is not None
    assert off(sighting, 0.8, 0.1) < 0.15


def test_it_is_found_in_dim_light_but_not_in_the_dark(renderer: RendererName) -> None:
    studio = before_hydrant(renderer)
    assert look(studio, light=0.6) is not None
    assert look(studio, light=0.2) is None
    assert look(studio, light=0.0) is None


def test_a_red_box_and_an_orange_ball_are_no_hydrants(renderer: RendererName) -> None:
    for yaw in (0.0, 0.4, 0.8, 1.2):
        studio = Studio(renderer, red_box=Pose2D(0.6, 0.15, yaw), orange_ball=Pose2D(0.6, -0.15, 0.0), base=BEFORE)
        for light in (1.0, 0.6, 0.45):
            assert look(studio, light=light) is None


def test_an_empty_room_has_no_hydrant(renderer: RendererName) -> None:
    assert look(Studio(renderer, base=BEFORE), replace(BEFORE, yaw=math.pi)) is None


def test_the_corner_camera_finds_it_without_knowing_where_the_robot_is(renderer: RendererName) -> None:
    studio = before_hydrant(renderer, "corner_camera")
    with Rig() as rig:
        rig.add(Detector)
        rig.add(Projector).pictures = [studio.picture()]
        sighting = rig.call("detect", Detect(), Sightings).best
    assert sighting is not None
    assert sighting.frame == "map"
    assert off(sighting, 0.8, 0.1) < 0.25


def test_without_odometry_the_place_is_given_relative_to_the_robot() -> None:
    studio = before_hydrant("ray")
    studio.put_robot(BEFORE.x, BEFORE.y, BEFORE.yaw)
    with Rig() as rig:
        rig.add(Detector)
        rig.add(Projector).pictures = [studio.picture()]
        sighting = rig.call("detect", Detect(), Sightings).best
    assert sighting is not None
    assert sighting.frame == "base_link"
    assert off(sighting, 1.2, 0.1) < 0.06


def test_in_many_rooms_and_lights_nothing_else_is_taken_for_a_hydrant() -> None:
    scene = frog_scene()
    looks = wrong = right = 0
    for seed in range(1, 9):
        placement = draw_placement(scene, seed)
        studio = Studio("ray", "camera", **placement.poses)
        ground = survey.ground_map(Simulation(scene, seed, placement=placement))
        random = np.random.default_rng(seed)
        hydrant = placement.poses["hydrant"]
        for n in range(10):
            x, y = (float(v) for v in random.uniform(-1.9, 1.9, 2))
            if not all(ground.is_free(x + dx, y + dy) for dx in (-0.2, 0.0, 0.2) for dy in (-0.2, 0.0, 0.2)):
                continue
            yaw = math.atan2(hydrant.y - y, hydrant.x - x) if n % 2 else float(random.uniform(-3.1, 3.1))
            sighting = look(studio, Pose2D(x, y, yaw), float(random.choice([1.0, 0.6, 0.45])))
            looks += 1
            if sighting is not None:
                wrong += off(sighting, hydrant.x, hydrant.y) > WRONG
                right += off(sighting, hydrant.x, hydrant.y) <= WRONG
    assert looks > 40
    assert wrong == 0
    assert right > 15


def test_it_looks_at_as_many_pictures_as_it_is_asked_to_and_tells_of_each() -> None:
    studio = before_hydrant("ray")
    pictures = [studio.picture(light) for light in (1.0, 0.1, 1.0, 1.0)]
    with Rig() as rig:
        set_up(rig, pictures)
        told = rig.collect("detections", Detections)
        sightings = rig.call("detect", Detect(pictures=3), Sightings)
        rig.advance(2.0)
    assert (sightings.pictures, sightings.hits) == (3, 2)
    assert [len(detections.objects) for detections in told] == [1, 0, 1]
    assert {detections.camera for detections in told} == {"camera"}


def test_how_many_pictures_is_its_own_choice_unless_told() -> None:
    studio = before_hydrant("ray")
    with Rig() as rig:
        set_up(rig, [studio.picture() for _ in range(5)], pictures=2)
        assert rig.call("detect", Detect(), Sightings).pictures == 2
        assert rig.call("detect", Detect(pictures=1), Sightings).pictures == 1


def test_only_pictures_of_the_robots_own_camera_take_energy() -> None:
    own, other = before_hydrant("ray"), before_hydrant("ray", "corner_camera")
    with Rig() as rig:
        set_up(rig, [own.picture(), other.picture(), own.picture()])
        used = rig.collect("energy", EnergyUse)
        seen = rig.call("detect", Detect(pictures=3), Sightings)
    assert [(use.consumer, use.energy) for use in used] == [("detector", 59.275)] * 2
    assert (seen.paid, seen.picture_energy) == (2, 59.275)


def test_two_who_ask_at_once_share_the_picture_and_its_energy() -> None:
    studio = before_hydrant("ray")
    with Rig() as rig:
        set_up(rig, [studio.picture()])
        used = rig.collect("energy", EnergyUse)
        asker = rig.add(Asker)
        seen = rig.call("detect", Detect(), Sightings)
        assert seen.hits == 1
        assert asker.hits == [1]
    assert len(used) == 1
    assert [seen.paid, *asker.paid] in ([1, 0], [0, 1])


class Asker(Component):
    """Asks the detector once."""

    def on_configure(self) -> None:
        self.hits: list[int] = []
        self.paid: list[int | None] = []

    def on_activate(self) -> None:
        self.kit.spawn(self.ask())

    async def ask(self) -> None:
        seen = await self.kit.call("detect", Detect(), Sightings)
        self.hits.append(seen.hits)
        self.paid.append(seen.paid)


def test_pauses_are_kept_between_pictures() -> None:
    studio = before_hydrant("ray")
    with Rig() as rig:
        set_up(rig, [studio.picture() for _ in range(20)], interval=1.0)
        told = rig.collect("detections", Detections)
        rig.call("detect", Detect(pictures=2), Sightings)
    assert [round(detections.stamp, 1) for detections in told] == [1.0, 2.0]


def test_when_no_picture_comes_the_request_is_refused_within_its_bound() -> None:
    with Rig() as rig:
        set_up(rig, [], picture_within=2.0)
        with pytest.raises(CallFailed, match="no picture within 2 s: is the camera active"):
            rig.call("detect", Detect(), Sightings)
        assert rig.clock.now() < 2.2e9


def test_when_the_pictures_end_it_answers_with_what_it_saw() -> None:
    studio = before_hydrant("ray")
    with Rig() as rig:
        set_up(rig, [studio.picture()], picture_within=1.0)
        assert rig.call("detect", Detect(pictures=3), Sightings).pictures == 1


def test_unknown_labels_are_refused() -> None:
    with Rig() as rig:
        set_up(rig, [])
        with pytest.raises(CallFailed, match="finds 'hydrant' only, not 'cat'"):
            rig.call("detect", Detect("cat"), Sightings)


def test_an_inactive_detector_refuses() -> None:
    with Rig() as rig:
        set_up(rig, [])
        rig.transition("detector", Transition.DEACTIVATE)
        with pytest.raises(CallFailed, match="only while active"):
            rig.call("detect", Detect(), Sightings)
