"""Scans are located only so often as the robot moves."""

from __future__ import annotations

import numpy as np
import pytest

from regraft.planar import Pose2D
from regraft.services.mapper.mapping import GridSettings, Mapping, Steps
from regraft.services.mapper.maps.grid import Grid
from regraft.services.mapper.maps.scan import Scan
from regraft.services.mapper.matching.localizer import Fix, Limits
from regraft.services.mapper.matching.matcher import Match


class CountingLocalizer:
    """Finds each robot where it is taken to be, and remembers when."""

    def __init__(self) -> None:
        self.limits = Limits()
        self.lost = False
        self.fits = True
        self.stamps: list[float] = []

    def locate(self, grid: Grid, scan: Scan, guess: Pose2D) -> Fix:
        self.stamps.append(scan.stamp)
        return Fix(guess, self.fits, Match(guess, 50, 50))

    def forget(self) -> None:
        pass


def drive(mapping: Mapping, seconds: float, speed: float = 0.0, turn: float = 0.0, begin: float = 0.0) -> None:
    """Drive on, with five scans a second that all differ."""
    for number in range(round(seconds * 5)):
        passed = 0.2 * number
        stamp = begin + passed
        mapping.take_odometry(stamp, Pose2D(speed * passed, 0.0, turn * passed))
        mapping.take_scan(Scan(stamp, np.full(90, 2.0 + 1e-4 * stamp), Pose2D()))


@pytest.fixture
def localizer() -> CountingLocalizer:
    return CountingLocalizer()


@pytest.fixture
def mapping(localizer: CountingLocalizer) -> Mapping:
    mapping = Mapping(GridSettings(), localizer)
    mapping.steps = Steps(0.2, 0.2)
    return mapping


def test_without_steps_every_scan_is_located(mapping: Mapping, localizer: CountingLocalizer) -> None:
    mapping.steps = Steps()
    drive(mapping, 4.0)
    assert len(localizer.stamps) == 20


def test_one_step_that_is_zero_has_every_scan_located(mapping: Mapping, localizer: CountingLocalizer) -> None:
    mapping.steps = Steps(0.2, 0.0)
    drive(mapping, 4.0)
    assert len(localizer.stamps) == 20


def test_a_robot_that_stands_is_located_once_and_counts_as_located(
    mapping: Mapping, localizer: CountingLocalizer
) -> None:
    drive(mapping, 4.0)
    assert localizer.stamps == [0.0]
    assert mapping.located_at == pytest.approx(3.8)


@pytest.mark.parametrize(("speed", "turn"), [(0.26, 0.0), (0.0, 0.26)])
def test_a_robot_that_moves_or_turns_is_located_after_each_step(
    mapping: Mapping, localizer: CountingLocalizer, speed: float, turn: float
) -> None:
    drive(mapping, 4.0, speed, turn)
    assert localizer.stamps == pytest.approx([0.0, 0.8, 1.6, 2.4, 3.2])


def test_a_scan_that_does_not_fit_is_followed_by_another_try_with_the_next(
    mapping: Mapping, localizer: CountingLocalizer
) -> None:
    localizer.fits = False
    drive(mapping, 1.0)
    assert len(localizer.stamps) == 5
    assert mapping.located_at is None


def test_a_robot_whose_place_is_given_anew_is_located_at_once(mapping: Mapping, localizer: CountingLocalizer) -> None:
    drive(mapping, 1.0)
    assert mapping.believe(0.8, Pose2D(1.0, 0.0, 0.0))
    drive(mapping, 1.0, begin=1.0)
    assert localizer.stamps == [0.0, 1.0]


def test_scans_that_repeat_each_other_count_for_nothing(mapping: Mapping, localizer: CountingLocalizer) -> None:
    for stamp in (0.0, 0.2, 0.4):
        mapping.take_odometry(stamp, Pose2D())
        mapping.take_scan(Scan(stamp, np.full(90, 2.0), Pose2D()))
    assert mapping.located_at == 0.0
