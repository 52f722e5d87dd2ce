"""Promises of the action ``charge``: in isolation, and with the navigator in the simulated room."""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft import Component, Output, Parameter, RequestRefused, action, every
from regraft.bus_schema.messages.geometry import Pose, Twist
from regraft.bus_schema.messages.navigation import Arrival, NavigateTo, NavigationProgress
from regraft.bus_schema.messages.power import BatteryState, Charge, Charged, ChargeProgress, ChargerState
from regraft.bus_schema.messages.sensors import Odometry
from regraft.component.goal import Goal
from regraft.services.battery import Battery
from regraft.services.charging.docking import Docking
from regraft.services.charging.search import places_to_try
from regraft.services.power_model import total_power
from regraft.testing import Rig

Charging = Goal[Charged, ChargeProgress]


class Driver(Component):
    """Drives like a navigator that is mistaken about its place, on a floor with a charger at (0, 0)."""

    mistake = Parameter(0.0, "how far beside its goal it really ends, along y", unit="m")
    seconds = Parameter(4.0, "how long a drive takes", unit="s")
    reach = Parameter(0.15, "of the charger", unit="m")
    power = Parameter(20.0, "of the charger", unit="W")
    fails = Parameter("", "why a drive does not arrive")
    refuses = Parameter("", "why a drive is refused")
    charger_works = Parameter(True, "whether the charger says anything")

    charger = Output(ChargerState)
    odometry = Output(Odometry)

    def on_configure(self) -> None:
        """Start somewhere."""
        self.x, self.y = 1.0, 1.0
        self.driven: list[tuple[float, float]] = []
        self.ended: list[str] = []

    @action("navigate_to", feedback=NavigationProgress)
    async def navigate_to(self, goal: NavigateTo) -> Arrival:
        """Be there after a while."""
        if self.refuses:
            raise RequestRefused(self.refuses)
        target = goal.goal.pose
        self.driven.append((round(target.x, 3), round(target.y, 3)))
        ended = "cancelled"
        try:
            arrival = self.kit.now() + self.seconds
            while self.kit.now() < arrival:
                left = arrival - self.kit.now()
                self.kit.feedback(NavigationProgress(0.2 * left, left, "driving"))
                await self.kit.sleep(min(0.5, left))
            ended = "done"
        finally:
            self.ended.append(ended)
        if not self.fails:
            self.x, self.y = target.x, target.y + self.mistake
        return Arrival(not self.fails, target, self.fails)

    @every(hz=2.0)
    def tell(self) -> None:
        """Say whether the robot stands on the charger."""
        on = math.hypot(self.x, self.y) <= self.reach
        if self.charger_works:
            self.charger.publish(ChargerState(self.kit.now(), on, self.power if on else 0.0))
        self.odometry.publish(Odometry(self.kit.now(), "odom", "base_link", Pose(), Twist()))


@dataclass
class Station:
    """A robot, its battery, and a dock."""

    rig: Rig
    driver: Driver
    docking: Docking

    def charge(self, until: float = 0.98) -> Charging:
        """Ask to be charged."""
        return self.rig.goal("charge", Charge(until), Charged, ChargeProgress)

    def result(self, goal: Charging, within: float = 300.0) -> Charged:
        """Let time pass until the goal has ended well."""
        self.rig.advance_until(lambda: goal.done, within)
        assert goal.result is not None, goal.error or "still charging"
        return goal.result


@pytest.fixture
def station() -> Iterator[Station]:
    """Return a station whose battery is at its limit."""
    with Rig() as rig:
        yield built(rig)


def built(rig: Rig, battery: bool = True, /, **driver: object) -> Station:
    """Put a station on a rig."""
    dock = Station(rig, rig.add(Driver, parameters=driver), rig.add(Docking))
    if battery:
        rig.add(Battery, parameters={"capacity": 2000.0, "initial_charge": 0.9})
    rig.advance(1.0)
    return dock


def test_the_robot_drives_to_the_dock_and_stays_until_the_battery_is_full_enough(station: Station) -> None:
    states = station.rig.collect("battery", BatteryState)
    charged = station.result(station.charge())
    assert (charged.charged, charged.reason) == (True, "")
    assert charged.charge == pytest.approx(0.98, abs=0.005)
    assert station.driver.driven == [(0.0, 0.0)]
    assert states[-1].charge >= 0.98
    assert station.docking.evaluate() == pytest.approx(
        {"docked": 1.0, "approaches": 1.0, "net_power": 20.0 - total_power(0.0)}
    )


def test_progress_and_time_left_are_told_and_come_true(station: Station) -> None:
    goal = station.charge()
    told: list[tuple[float, ChargeProgress]] = []
    while not goal.done:
        station.rig.advance(0.25)
        if goal.feedback is not None and (not told or told[-1][1] is not goal.feedback):
            told.append((station.rig.clock.now() / 1e9, goal.feedback))
    end = station.rig.clock.now() / 1e9
    phases = [progress.phase for _, progress in told]
    assert phases == sorted(phases, key=["driving", "charging"].index)
    assert {"driving", "charging"} == set(phases)
    # Only after its first word does the navigator's share of the time count.
    for time, progress in told[1:]:
        assert progress.time_left == pytest.approx(end - time, abs=2.5)


def test_a_battery_that_is_full_enough_needs_no_drive(station: Station) -> None:
    assert station.result(station.charge(0.5)).charged
    assert station.driver.driven == []


def test_a_robot_that_stands_on_the_dock_already_does_not_drive(station: Station) -> None:
    station.driver.x = station.driver.y = 0.0
    station.rig.advance(1.0)
    assert station.result(station.charge()).charged
    assert station.driver.driven == []


@pytest.mark.parametrize("mistake", [-0.28, -0.2, 0.2, 0.28])
def test_a_dock_that_is_not_felt_where_it_should_be_is_searched_for(mistake: float) -> None:
    with Rig() as rig:
        station = built(rig, mistake=mistake)
        assert station.result(station.charge()).charged
        assert station.driver.driven[0] == (0.0, 0.0)
        assert len(station.driver.driven) > 1


def test_a_charger_that_is_nowhere_is_given_up_with_the_reason() -> None:
    with Rig() as rig:
        station = built(rig, reach=0.0, mistake=1.0)
        charged = station.result(station.charge())
        assert not charged.charged
        assert charged.reason == "no charger felt at (0, 0) in 5 approaches"
        assert len(station.driver.driven) == 5


def test_a_charger_that_says_nothing_is_told_from_one_that_is_not_felt() -> None:
    with Rig() as rig:
        station = built(rig, charger_works=False)
        charged = station.result(station.charge())
    assert charged.reason == "at the dock, but no charger has reported within 1.5 s"
    assert len(station.driver.driven) == 1


@pytest.mark.parametrize(
    ("driver", "reason"),
    [
        ({"fails": "stuck behind a box"}, "did not get to the dock: stuck behind a box"),
        ({"refuses": "no map has come"}, "cannot drive to the dock: navigate_to: no map has come"),
    ],
)
def test_a_failed_drive_is_told_with_its_reason(driver: dict[str, str], reason: str) -> None:
    with Rig() as rig:
        station = built(rig, **driver)
        charged = station.result(station.charge())
    assert (charged.charged, charged.reason) == (False, reason)


def test_without_anybody_to_drive_charging_fails_with_the_reason() -> None:
    with Rig() as rig:
        station = built(rig)
        rig.runtimes["driver"].leave()
        del rig.runtimes["driver"]
        charged = station.result(station.charge())
    assert charged.reason.startswith("cannot drive to the dock: navigate_to: ")


def test_without_a_word_from_the_battery_charging_is_refused() -> None:
    with Rig() as rig:
        station = built(rig, False)
        goal = station.charge()
        rig.advance(6.0)
        assert "no word from the battery within 5 s" in str(goal.error)
        assert station.driver.driven == []


def test_a_battery_that_falls_silent_while_charging_is_told() -> None:
    with Rig() as rig:
        station = built(rig)
        goal = station.charge()
        rig.advance(8.0)
        rig.runtimes["battery"].leave()
        del rig.runtimes["battery"]
        charged = station.result(goal)
    assert charged.reason == "no word from the battery for 3 s while charging"


def test_a_charger_too_weak_to_charge_is_given_up_saying_so() -> None:
    with Rig() as rig:
        station = built(rig, power=5.0)
        charged = station.result(station.charge())
    assert charged.reason.startswith("the charge has not risen for 20 s: the charger gives 5 W, 7.1 W")


def test_a_robot_that_is_pushed_off_the_dock_returns_to_it(station: Station) -> None:
    goal = station.charge()
    station.rig.advance(8.0)
    station.driver.x = 1.0
    assert station.result(goal).charged
    assert len(station.driver.driven) == 2


@pytest.mark.parametrize("after", [2.0, 8.0])
def test_cancelling_stops_the_drive_and_the_waiting_at_once(station: Station, after: float) -> None:
    goal = station.charge()
    station.rig.advance(after)
    goal.cancel()
    station.rig.settle()
    assert goal.done
    assert goal.error is not None
    assert station.driver.ended == ["cancelled" if after == 2.0 else "done"]


def test_a_newer_goal_replaces_the_one_before(station: Station) -> None:
    first = station.charge()
    station.rig.advance(2.0)
    second = station.charge(0.95)
    assert station.result(second).charged
    assert "replaced" in str(first.error)


def test_charging_takes_as_long_as_was_estimated(station: Station) -> None:
    station.driver.x = station.driver.y = 0.0
    station.rig.advance(1.0)
    charge = station.rig.collect("battery", BatteryState)
    station.rig.advance(0.5)
    context = {"charge": charge[-1].charge, "capacity": 2000.0}
    begun = station.rig.clock.now() / 1e9
    station.result(station.charge())
    took = station.rig.clock.now() / 1e9 - begun
    assert took == pytest.approx(Docking.estimate({}, context)["charging_time"], abs=1.5)


@given(st.floats(-3.0, 3.0), st.floats(0.05, 0.3), st.integers(1, 9))
def test_the_search_begins_at_the_dock_and_goes_outwards_facing_its_way(
    yaw: float, distance: float, count: int
) -> None:
    dock = Pose.planar(0.5, -0.5, yaw)
    places = list(itertools.islice(places_to_try(dock, distance), count))
    away = [math.hypot(place.x - dock.x, place.y - dock.y) for place in places]
    assert len(places) == count
    assert places[0] == dock
    assert away == pytest.approx(sorted(away))
    assert {round(place.yaw, 6) for place in places} == {round(dock.yaw, 6)}
    assert len({(round(place.x, 6), round(place.y, 6)) for place in places}) == count
