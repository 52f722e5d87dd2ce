"""ReBeT's plans as they were published do what they were published to do, faults included."""

from __future__ import annotations

import pytest

from regraft.testing import Rig
from tests.missions import test_rounds
from tests.missions.acting import CORNER
from tests.missions.robot import NODES, darkness
from tests.missions.test_rounds import FAR, NEAR, Rounds


@pytest.fixture(autouse=True)
def published_nodes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(test_rounds, "NODES", f"{NODES} regraft.stacks.frog.studies.published_plans:NODES")


def test_the_first_decision_is_down_as_nothing_is_measured_yet_and_then_up_again() -> None:
    with Rig() as rig:
        rounds = Rounds(rig, "published_internal", drives=60.0)
        rounds.senses.values["nearest"] = FAR
        rig.advance(10.0)
        assert rounds.speeds == [(3.0, 0.18), (6.0, 0.26)]


def test_it_slows_down_near_obstacles() -> None:
    with Rig() as rig:
        rounds = Rounds(rig, "published_internal", drives=60.0)
        rounds.senses.values["nearest"] = NEAR
        rig.advance(10.0)
        assert rounds.speeds == [(3.0, 0.18), (6.0, 0.1)]


def test_what_a_leg_costs_is_known_when_it_is_over_and_a_sum_of_samples() -> None:
    with Rig() as rig:
        rounds = Rounds(rig, "published_internal", drives=14.0)
        rig.advance(10.0)
        assert rounds.board["leg_power"] == -10.0
        rig.advance(10.0)
        assert rounds.board["leg_power"] == pytest.approx(7 * 6.63, rel=0.15)


def test_a_call_for_three_pictures_costs_nine_and_the_switch_to_the_corner_camera_is_for_good() -> None:
    with Rig() as rig:
        rounds = Rounds(rig, "published_internal", drives=5.0)
        darkness(rig, 0.9)
        rig.advance(60.0)
        left = rounds.board["published_left"]
        assert (7113.0 - left) / 59.275 % 9 == pytest.approx(0.0, abs=1e-3)
        assert left < 0.0
        assert rounds.cameras == [CORNER]
        darkness(rig, 0.1)
        rig.advance(30.0)
        assert rounds.cameras == [CORNER]
        assert rounds.board["published_left"] < left
