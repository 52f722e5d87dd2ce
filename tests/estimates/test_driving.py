"""What driving gives and takes is as navigators, battery and mappers estimate; all speeds: tests/evidence."""

from __future__ import annotations

import pytest

from regraft.services.battery import Battery
from regraft.services.mapper.mapper import Mapper
from regraft.services.mapper.odometry_mapper import OdometryMapper
from regraft.services.navigator.navigator import Navigator
from regraft.services.navigator.pursuit_navigator import PursuitNavigator
from regraft.services.power_model import IDLE_POWER, LIDAR_POWER
from regraft.testing import Rig

from .course import MAPPERS, TRAVEL_NOISE, Course, Truth

pytestmark = pytest.mark.slow

CASES: list[tuple[type[Navigator], float]] = [(Navigator, 0.26), (PursuitNavigator, 0.18)]
Driven = tuple[type[Navigator], float, Truth]


@pytest.fixture(scope="module", params=CASES, ids=lambda case: f"{case[0].__name__}-{case[1]}")
def driven(request: pytest.FixtureRequest) -> Driven:
    """Return what really happens on a course."""
    kind, max_velocity = request.param
    with Rig(seed=2) as rig:
        return kind, max_velocity, Course(rig, kind, max_velocity, capacity=2000.0).drive()


def test_straight_on_it_is_as_fast_and_takes_as_much_as_estimated(driven: Driven) -> None:
    kind, max_velocity, truth = driven
    estimate = kind.estimate({"max_velocity": max_velocity}, {})
    speed, power = truth.cruise()
    assert speed == pytest.approx(estimate["speed"], rel=0.05)
    assert power == pytest.approx(estimate["power"], rel=0.05)
    assert power / speed == pytest.approx(estimate["energy_per_metre"], rel=0.05)
    assert max(truth.speeds) <= estimate["speed"] + 0.01


def test_drives_take_the_time_and_the_energy_estimated(driven: Driven) -> None:
    kind, max_velocity, truth = driven
    context = {"distance": truth.distance / truth.drives}
    estimate = kind.estimate({"max_velocity": max_velocity}, context)
    assert truth.seconds / truth.drives == pytest.approx(estimate["drive_time"], rel=0.15)
    assert truth.motion_energy / truth.drives == pytest.approx(estimate["drive_energy"], rel=0.15)


def test_it_drives_as_safely_as_estimated(driven: Driven) -> None:
    kind, max_velocity, truth = driven
    estimate = kind.estimate({"max_velocity": max_velocity}, {})
    assert truth.safety == pytest.approx(estimate["safety"], abs=0.08)
    assert truth.contacts == 0


def test_the_battery_gives_what_all_together_draw_and_reaches_its_limit_when_estimated(driven: Driven) -> None:
    _, _, truth = driven
    estimate = Battery.estimate({"capacity": 2000.0}, {"speed": truth.mean_speed, "charge": truth.charge[0]})
    parts = truth.motion_energy + (LIDAR_POWER + IDLE_POWER) * truth.seconds
    assert truth.drawn == pytest.approx(parts, rel=0.03)
    assert truth.drawn / truth.seconds == pytest.approx(estimate["power"], rel=0.05)
    assert truth.to_limit == pytest.approx(estimate["time_to_limit"], rel=0.12)


def test_the_mappers_are_as_wrong_about_the_place_as_estimated(driven: Driven) -> None:
    truth = driven[2]
    context = {"travel_noise": TRAVEL_NOISE, "distance": truth.distance}
    matched = Mapper.estimate({}, context)["pose_error"]
    assert matched / 3.0 <= truth.errors[MAPPERS[Mapper]] <= 3.0 * matched
    # A drift is a random walk: how far one drive is off is at most a few times what it is in the mean.
    trusted = OdometryMapper.estimate({}, context)["pose_error"]
    assert truth.errors[MAPPERS[OdometryMapper]] <= 3.0 * trusted
    assert Mapper.estimate({}, context)["pose_error"] < trusted


def test_the_map_is_as_good_as_estimated(driven: Driven) -> None:
    quality = driven[2].iou[MAPPERS[Mapper]]
    assert quality == pytest.approx(Mapper.estimate({}, {})["map_quality"], abs=0.15)
