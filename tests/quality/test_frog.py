"""FROG's requirements mean what the paper says, on both sides of each threshold."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft.bus_schema.messages.mission import MissionState
from regraft.stacks.frog.quality import REQUIREMENTS
from regraft.stacks.frog.utility import NEAR, moves_safely
from regraft.testing import Rig
from tests.executor.helpers import run, status, tree
from tests.quality.helpers import Field

RANGE = 3.5 - 0.12


def frog(tag: str, ports: str, child: str = "<Spelt/>", **board: object) -> Field:
    """Return a requirement of FROG's, ticked once."""
    field = Field(f"<{tag} {ports}>{child}</{tag}>", *REQUIREMENTS, board=board)
    field.tick()
    return field


def at_share(share: float) -> float:
    """Return the distance in metres that is a share of the lidar's range."""
    return 0.12 + share * RANGE


@pytest.mark.parametrize(
    ("share", "speed", "safe"),
    [
        (0.11, 0.26, True),
        (0.09, 0.26, False),
        (0.09, 0.17, True),
        (0.09, -0.17, True),
        (0.09, 0.18, False),
        (0.11, 0.10, True),
    ],
)
def test_the_robot_moves_safely_while_nothing_is_near_or_it_is_slow(share: float, speed: float, safe: bool) -> None:
    field = frog("MoveSafely", 'nearest="{@d}" speed="{@v}" metric="{m}"', d=at_share(share), v=speed)
    assert field.quality("MoveSafely").satisfied is safe
    assert field.get("m") == pytest.approx(share)


@given(st.floats(0.0, 10.0), st.floats(-0.3, 0.3))
def test_moving_safely_has_one_meaning(distance: float, speed: float) -> None:
    told = frog("MoveSafely", 'nearest="{@d}" speed="{@v}"', d=distance, v=speed).quality("MoveSafely")
    share = min(max((distance - 0.12) / RANGE, 0.0), 1.0)
    assert told.metric == share
    assert told.satisfied == moves_safely(distance, speed) == (distance >= NEAR or abs(speed) < 0.18)


@pytest.mark.parametrize(
    ("speed", "metric", "degree"),
    [(0.26, 1.0, 1.0), (0.18, 0.18 / 0.26, 0.5), (0.10, 0.10 / 0.26, 0.0), (0.03, None, None), (0.3, 1.0, 1.0)],
)
def test_the_robot_moves_quickly_the_closer_it_is_to_its_maximum(
    speed: float, metric: float | None, degree: float | None
) -> None:
    told = frog("MoveQuickly", 'speed="{@v}"', v=speed).quality("MoveQuickly")
    assert told.metric == (None if metric is None else pytest.approx(metric))
    assert told.degree == (None if degree is None else pytest.approx(degree))


def test_the_energy_of_a_drive_is_in_joules_and_told_when_it_ends() -> None:
    field = frog("MovePowerEfficiently", 'motion_power="{@p}" metric="{j}"', "<Spelt script='RRRS'/>", p=5.9)
    field.tick(10.0)
    field.tick(5.0)
    assert field.tick(0.8) == "S"
    told = field.quality("MovePowerEfficiently")
    assert field.get("j") == pytest.approx(15.8 * 5.9)
    assert (told.higher_is_better, told.active, told.satisfied) == (False, False, False)
    assert told.degree == pytest.approx(1.0 - 15.8 * 5.9 / 160.0)


def look(field: Field, looked: int, hits: int) -> None:
    """Have one call of the detector answered."""
    field.tick()
    field.put("looked", looked)
    field.put("hits", hits)
    assert field.tick(1.0) == "S"


def test_hits_are_counted_by_picture_and_each_answer_once() -> None:
    field = frog(
        "DetectEffectively",
        'hits="{@hits}" looked="{@looked}" metric="{m}"',
        "<Spelt script='KRSRSRS'/>",
        looked=7,
        hits=7,
    )
    look(field, 3, 1)
    assert field.get("m") == pytest.approx(1 / 3)
    look(field, 3, 1)
    look(field, 1, 1)
    assert field.get("m") == pytest.approx(3 / 7)
    assert field.quality("DetectEffectively").satisfied is False


def test_a_cameras_hit_rate_is_learned_from_one_half_on_by_its_own_pictures_only() -> None:
    ports = 'hits="{@hits}" looked="{@looked}" image_topic="{@seen_by}" metric="{m}"'
    field = frog("CameraHitRate", ports, "<Spelt script='RRSRRS'/>", seen_by="corner_camera/image")
    assert field.get("m") == pytest.approx(0.5)
    look(field, 3, 3)
    assert field.get("m") == pytest.approx(4 / 5)
    field.tick()
    field.put("seen_by", "camera/image")
    look(field, 3, 0)
    assert field.get("m") == pytest.approx(4 / 5)
    assert field.quality("CameraHitRate").satisfied is None


def test_without_a_camera_the_hit_rate_is_that_of_all() -> None:
    ports = 'hits="{@hits}" looked="{@looked}" image_topic="{@seen_by}" camera="" metric="{m}"'
    field = frog("CameraHitRate", ports, "<Spelt script='RRSRRS'/>", seen_by="corner_camera/image")
    look(field, 3, 3)
    field.tick()
    field.put("seen_by", "camera/image")
    look(field, 3, 0)
    assert field.get("m") == pytest.approx(4 / 8)


def paid(field: Field, pictures: int, energy: float = 59.275) -> None:
    """Have one call of the detector answered, for which the robot has paid."""
    field.tick()
    field.put("energy", energy)
    field.put("paid", pictures)
    assert field.tick(1.0) == "S"


PAID = 'paid="{@paid}" picture_energy="{@energy}" metric="{used}" energy_left="{left}"'


def test_a_budget_pays_for_120_pictures_of_the_robots_own_camera_and_for_no_others() -> None:
    field = frog("DetectPowerEfficiently", PAID, "<Spelt script='KRS'/>")
    assert field.get("left") == pytest.approx(7113.0)
    paid(field, 3)
    assert field.get("used") == 3 * 59.275
    field.tick()
    paid(field, 0)
    assert field.get("used") == 3 * 59.275
    field.tick()
    paid(field, 117)
    assert field.get("left") == pytest.approx(0.0, abs=1e-9)
    assert field.quality("DetectPowerEfficiently").satisfied is True
    field.tick()
    paid(field, 1)
    assert field.quality("DetectPowerEfficiently").satisfied is False


def test_each_picture_takes_what_its_detector_reports() -> None:
    field = frog("DetectPowerEfficiently", PAID, "<Spelt script='KRS'/>")
    paid(field, 2)
    field.tick()
    paid(field, 3, 1.5 * 59.275)
    assert field.get("used") == pytest.approx(6.5 * 59.275)


def test_pictures_of_a_detector_that_reports_no_energy_take_what_frogs_do() -> None:
    field = frog("DetectPowerEfficiently", PAID, "<Spelt script='RSRSRS'/>")
    assert field.quality("DetectPowerEfficiently").metric == 0.0
    field.put("paid", 3)
    field.tick()
    assert field.quality("DetectPowerEfficiently").metric == pytest.approx(3 * 59.275)
    assert field.get("left") == pytest.approx(7113.0 - 3 * 59.275)


def test_an_answer_whose_camera_is_not_known_yet_is_counted_as_soon_as_it_is() -> None:
    ports = 'hits="{@hits}" looked="{@looked}" image_topic="{@seen_by}" metric="{m}"'
    field = frog("CameraHitRate", ports, "<Spelt script='RSRSRS'/>")
    field.put("looked", 3)
    field.put("hits", 3)
    for _ in range(3):
        field.tick()
        assert field.quality("CameraHitRate").metric is None
    field.put("seen_by", "corner_camera/image")
    field.tick()
    assert field.quality("CameraHitRate").metric == pytest.approx(4 / 5)


@pytest.mark.parametrize(("charge", "satisfied"), [(0.91, True), (0.90, True), (0.899, False)])
def test_the_battery_is_to_be_at_least_nine_tenths_full(charge: float, satisfied: bool) -> None:
    inner = '<MinBatteryNavigation battery_charge="{@c}" motion_power="{@p}"><Spelt/></MinBatteryNavigation>'
    field = frog("MinBatterySystem", 'battery_charge="{@c}" power="{w}" out_status="{s}"', inner, c=charge, p=5.0)
    assert field.quality("MinBatterySystem").satisfied is satisfied
    assert field.quality("MinBatteryNavigation").satisfied is satisfied
    assert field.get("w") == pytest.approx(5.0 + 2.34 + 1.14)
    assert field.get("s") == ("OK" if satisfied else "below_min")


@pytest.mark.parametrize("node_class", REQUIREMENTS, ids=lambda node_class: node_class.__name__)
def test_without_data_no_requirement_says_more_than_it_knows(node_class: type) -> None:
    ports = {
        "MoveSafely": 'nearest="{@a}" speed="{@b}"',
        "MoveQuickly": 'speed="{@a}"',
        "MovePowerEfficiently": 'motion_power="{@a}"',
        "DetectEffectively": 'hits="{@a}" looked="{@b}"',
        "MinBatteryNavigation": 'battery_charge="{@a}" motion_power="{@b}"',
        "MinBatterySystem": 'battery_charge="{@a}"',
    }
    name = node_class.__name__
    if name in ports:
        told = frog(name, ports[name]).quality(name)
        assert (told.metric, told.satisfied, told.status) == (None, None, "unknown")
    elif name == "CameraHitRate":
        told = frog(name, 'hits="{@a}" looked="{@b}" image_topic="{@c}"').quality(name)
        assert (told.metric, told.satisfied) == (0.5, None)
    else:
        told = frog(name, 'paid="{@a}"').quality(name)
        assert (told.metric, told.satisfied) == (0.0, True)


CHARGE_OR_DRIVE = tree(
    """<Script code="@drives := 0; @how := 'OK'; @battery_charge := 1.0; @charges := 0"/>""",
    """<RetryUntilSuccessful num_attempts="-1"><Switch2 variable="{@how}" case_1="below_min" case_2="OK">
         <ForceFailure><Sequence><Sleep msec="1000"/>
           <Script code="@battery_charge = 1.0; @how = 'OK'; @charges += 1"/></Sequence></ForceFailure>
         <MinBatterySystem battery_charge="{@battery_charge}" out_status="{@how}"><Sequence>
           <Sleep msec="500"/><Script code="@battery_charge -= 0.06; @drives += 1"/>
           <ScriptCondition code="@drives >= 5"/></Sequence></MinBatterySystem>
         <AlwaysFailure/></Switch2></RetryUntilSuccessful>""",
)


def test_a_mission_goes_to_charge_when_its_requirement_is_violated() -> None:
    with Rig() as rig:
        run(rig, CHARGE_OR_DRIVE, nodes="regraft.stacks.frog.quality:REQUIREMENTS")
        rig.advance(15.0)
        now = status(rig)
        assert now.state is MissionState.SUCCEEDED
        assert (now.blackboard["drives"], now.blackboard["charges"]) == (5, 2)
