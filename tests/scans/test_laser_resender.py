"""The resender passes on plausible scans, and fails itself when its lidar does."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
import pytest

from regraft.bus_schema.messages.geometry import Pose
from regraft.bus_schema.messages.power import EnergyUse
from regraft.bus_schema.messages.sensors import LaserScan
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.services.scans.laser_resender import LaserResender
from regraft.testing import Rig
from tests.services.rigs import run, set_parameters, world_on

PERIOD = 0.2
Ranges = np.ndarray[tuple[int], np.dtype[np.float32]]


@dataclass
class Lidar:
    """A lidar with noise that can be spoiled, and what the resender makes of it."""

    rig: Rig
    passed: list[LaserScan]
    energy: list[EnergyUse]
    spoil: Callable[[Ranges], Ranges] = lambda ranges: ranges
    ahead: float = 0.0
    sent: list[LaserScan] = field(default_factory=list)
    noise: np.random.Generator = field(default_factory=lambda: np.random.default_rng(1))

    def run(self, seconds: float, *, speaks: bool = True) -> None:
        """Let time pass, with five scans a second if the lidar ``speaks``."""
        for _ in range(round(seconds / PERIOD)):
            if speaks:
                ranges = (2.0 + 0.01 * self.noise.standard_normal(90)).astype(np.float32)
                now = self.rig.clock.now() / 1e9 + self.ahead
                scan = LaserScan(now, "lidar", "base_link", Pose(), 0.0, math.tau / 90, 0.1, 8.0, self.spoil(ranges))
                self.sent.append(scan)
                self.rig.publish("raw", scan)
            self.rig.advance(PERIOD)

    @property
    def works(self) -> bool:
        return self.rig.state("resender") is State.ACTIVE

    @property
    def failure(self) -> str:
        return self.rig.status("resender").failure


@pytest.fixture
def lidar() -> Iterator[Lidar]:
    with Rig(start=10.0) as rig:
        found = Lidar(rig, rig.collect("scan", LaserScan), rig.collect("energy", EnergyUse))
        rig.add(LaserResender, "resender", {"power": 8.0})
        yield found


def share_of(value: float, share: float) -> Callable[[Ranges], Ranges]:
    def spoil(ranges: Ranges) -> Ranges:
        ranges[: round(share * len(ranges))] = value
        return ranges

    return spoil


def test_plausible_scans_are_passed_on_unchanged(lidar: Lidar) -> None:
    lidar.run(4.0)
    assert lidar.works
    assert len(lidar.passed) == len(lidar.sent) == 20
    for sent, passed in zip(lidar.sent, lidar.passed, strict=True):
        np.testing.assert_array_equal(sent.ranges, passed.ranges)
        assert (sent.stamp, sent.frame, sent.angle_increment) == (passed.stamp, passed.frame, passed.angle_increment)


def test_a_silent_lidar_is_a_failure_of_the_resender(lidar: Lidar) -> None:
    lidar.run(2.0)
    lidar.run(0.4, speaks=False)
    assert lidar.works
    lidar.run(0.4, speaks=False)
    assert lidar.rig.state("resender") is State.UNCONFIGURED
    assert lidar.failure.startswith("the lidar fails (silent): no scan has come for 0.")
    assert [event.subject for event in lidar.rig.events if event.kind == "component.failed"] == ["resender"]


def test_a_lidar_may_take_longer_for_its_first_scan(lidar: Lidar) -> None:
    lidar.run(0.8, speaks=False)
    lidar.run(2.0)
    assert lidar.works
    assert len(lidar.passed) == 10


def test_a_lidar_that_never_speaks_fails_soon_after_the_activation(lidar: Lidar) -> None:
    lidar.run(1.0, speaks=False)
    assert lidar.works
    lidar.run(0.4, speaks=False)
    assert lidar.failure.startswith("the lidar fails (silent)")


def test_equal_scans_are_not_passed_on_and_soon_are_a_failure(lidar: Lidar) -> None:
    lidar.run(2.0)
    frozen = lidar.sent[-1].ranges
    lidar.spoil = lambda _: frozen
    lidar.run(0.8)
    assert lidar.works
    assert len(lidar.passed) == 10
    lidar.run(0.6)
    assert lidar.failure.startswith("the lidar fails (frozen): exactly the same scan")


def test_scans_that_freeze_for_a_moment_are_no_failure(lidar: Lidar) -> None:
    lidar.run(2.0)
    frozen = lidar.sent[-1].ranges
    lidar.spoil = lambda _: frozen
    lidar.run(0.8)
    lidar.spoil = lambda ranges: ranges
    lidar.run(2.0)
    assert lidar.works
    assert len(lidar.passed) == 20


@pytest.mark.parametrize(
    ("value", "share", "fault"),
    [
        (0.0, 1.0, "zeros"),
        (0.0, 0.5, "zeros"),
        (0.05, 1.0, "zeros"),
        (math.nan, 0.6, "zeros"),
        (-math.inf, 0.6, "zeros"),
        (math.inf, 1.0, "empty"),
        (9.0, 1.0, "empty"),
    ],
)
def test_two_scans_without_ranges_are_a_failure_and_are_not_passed_on(
    lidar: Lidar, value: float, share: float, fault: str
) -> None:
    lidar.run(2.0)
    lidar.spoil = share_of(value, share)
    lidar.run(0.2)
    assert lidar.works
    lidar.run(0.4)
    assert lidar.failure.startswith(f"the lidar fails ({fault}): ")
    assert len(lidar.passed) == 10


@pytest.mark.parametrize(("value", "share"), [(0.0, 0.4), (math.inf, 0.98)])
def test_single_beams_may_be_without_a_range(lidar: Lidar, value: float, share: float) -> None:
    lidar.spoil = share_of(value, share)
    lidar.run(3.0)
    assert lidar.works
    assert len(lidar.passed) == 15


def test_scans_in_the_wrong_order_are_not_passed_on(lidar: Lidar) -> None:
    lidar.run(1.0)
    lidar.rig.publish("raw", lidar.sent[-2])
    assert len(lidar.passed) == 5


def test_a_scan_from_the_future_is_not_passed_on_and_those_after_it_are(lidar: Lidar) -> None:
    lidar.run(1.0)
    lidar.ahead = 1e6
    lidar.run(0.2)
    lidar.ahead = 0.0
    lidar.run(1.0)
    assert lidar.works
    assert len(lidar.passed) == 10
    lidar.run(1.0, speaks=False)
    assert lidar.failure.startswith("the lidar fails (silent)")


@pytest.mark.parametrize("ahead", [2.0, 1e6])
def test_scans_from_the_future_are_a_failure(lidar: Lidar, ahead: float) -> None:
    lidar.run(1.0)
    lidar.ahead = ahead
    lidar.run(0.6)
    assert lidar.rig.state("resender") is State.UNCONFIGURED
    assert lidar.failure.startswith("the lidar fails (ahead): ")
    assert len(lidar.passed) == 5


def test_the_lidar_s_clock_may_be_a_little_ahead(lidar: Lidar) -> None:
    lidar.ahead = 0.5
    lidar.run(2.0)
    assert lidar.works
    assert len(lidar.passed) == 10


def test_a_further_configuration_tries_the_lidar_again(lidar: Lidar) -> None:
    lidar.run(2.0)
    lidar.run(1.0, speaks=False)
    assert lidar.failure
    lidar.rig.transition("resender", Transition.CONFIGURE)
    lidar.rig.transition("resender", Transition.ACTIVATE)
    lidar.run(2.0)
    assert lidar.works
    assert not lidar.failure
    assert len(lidar.passed) == 20


def test_the_lidar_s_energy_is_booked_for_the_time_in_which_it_is_active(lidar: Lidar) -> None:
    lidar.run(3.2)
    lidar.rig.transition("resender", Transition.DEACTIVATE)
    assert sum(use.energy for use in lidar.energy) == pytest.approx(8.0 * 3.2)
    assert {use.consumer for use in lidar.energy} == {"resender"}
    lidar.run(2.0)
    lidar.rig.transition("resender", Transition.ACTIVATE)
    lidar.run(1.0)
    assert sum(use.energy for use in lidar.energy) == pytest.approx(8.0 * 4.2)


def test_a_failure_ends_the_booking(lidar: Lidar) -> None:
    lidar.run(1.0)
    lidar.run(3.0, speaks=False)
    assert not lidar.works
    assert 8.0 * 1.4 < sum(use.energy for use in lidar.energy) < 8.0 * 2.0


def test_its_power_is_estimated_and_measured(lidar: Lidar) -> None:
    measured = lidar.rig.collect_qualities("resender")
    lidar.run(2.0)
    assert LaserResender.estimate({"power": 8.0}, {}) == {"power": 8.0} == measured[-1].values
    assert LaserResender.estimate({}, {}) == {"power": 0.0}


def test_zeros_of_a_simulated_lidar_are_noticed() -> None:
    with Rig(seed=3) as rig:
        world = world_on(rig)
        passed = rig.collect("passed", LaserScan)
        rig.add(LaserResender, "resender", {}, {"raw": "scan", "scan": "passed"})
        run(rig, world, 1.0)
        assert rig.state("resender") is State.ACTIVE
        assert len(passed) >= 4
        set_parameters(rig, "world", scan_failure="zeros")
        run(rig, world, 0.6)
        assert rig.status("resender").failure.startswith("the lidar fails (zeros)")
