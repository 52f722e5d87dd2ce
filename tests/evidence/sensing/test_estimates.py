"""Estimates beside what really happens, as tables; and what FROG's processes take of the machine.

The mappers' are in test_mapper.py, the detectors' in test_detection.py, safety over six rooms in test_navigator.py.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from regraft import Component
from regraft.bus_schema.messages.maps import Frontier, NextFrontier
from regraft.bus_schema.messages.navigation import Arrival, NavigateTo, NavigationProgress
from regraft.bus_schema.messages.world import GroundTruth
from regraft.services.battery import Battery
from regraft.services.explorer.explorer import Explorer
from regraft.services.explorer.strategies import STRATEGIES
from regraft.services.mapper.mapper import Mapper
from regraft.services.navigator.navigator import Navigator
from regraft.services.navigator.pursuit_navigator import PursuitNavigator
from regraft.testing import Rig
from tests.estimates.course import TRAVEL_NOISE, Course, Truth
from tests.estimates.dock import charge
from tests.services.rigs import TICK, run_until, world_on
from tests.support.paths import FROG
from tests.support.systems import System, all_ended, home
from tests.support.waiting import wait_until

pytestmark = [pytest.mark.evidence, pytest.mark.alone, pytest.mark.timeout(3600)]

SEEDS = (1, 2, 3)
MARGIN = 2.0
"""A busy machine, with cold caches and two threads on a core, takes up to twice the time for the same work."""
MEMORY_MARGIN = 1.5
MEASURED_FOR = 10.0
"""s, simulated, at the pace of the wall clock."""
PATIENCE = 60.0


def line(name: str, estimated: float, true: float) -> None:
    """Print a quality as estimated and as it is."""
    print(f"{name:44} {estimated:9.3f} {true:9.3f} {true / estimated - 1.0 if estimated else 0.0:+8.1%}")


@pytest.mark.parametrize("kind", [Navigator, PursuitNavigator], ids=lambda kind: kind.__name__)
def test_drives_in_three_rooms_are_as_estimated_at_all_speeds(kind: type[Navigator]) -> None:
    print(f"\n{kind.__name__}: quality, estimated, true")
    for max_velocity in (0.26, 0.22, 0.18, 0.10):
        rounds = [_round(kind, seed, max_velocity) for seed in SEEDS]
        drives, distance = sum(each.drives for each in rounds), sum(each.distance for each in rounds)
        told = kind.estimate({"max_velocity": max_velocity}, {"distance": distance / drives})
        seconds, cruises = sum(each.seconds for each in rounds), [each.cruise() for each in rounds]
        speed, power = (float(np.mean([cruise[n] for cruise in cruises])) for n in (0, 1))
        true = {
            "speed": speed,
            "power": power,
            "energy_per_metre": power / speed,
            "safety": sum(each.safety * each.seconds for each in rounds) / seconds,
            "drive_time": seconds / drives,
            "drive_energy": sum(each.motion_energy for each in rounds) / drives,
        }
        assert true.keys() == told.keys()
        for quality, value in true.items():
            line(f"{max_velocity:.2f} m/s {quality}", told[quality], value)
            assert value == pytest.approx(told[quality], rel=0.12), quality
        _check_battery(max_velocity, rounds)


def _round(kind: type[Navigator], seed: int, max_velocity: float) -> Truth:
    with Rig(seed=seed) as rig:
        return Course(rig, kind, max_velocity, capacity=2000.0).drive()


def _check_battery(max_velocity: float, rounds: list[Truth]) -> None:
    for truth in rounds:
        told = Battery.estimate({"capacity": 2000.0}, {"speed": truth.mean_speed, "charge": truth.charge[0]})
        assert truth.to_limit is not None
        line(f"{max_velocity:.2f} m/s battery power", told["power"], truth.drawn / truth.seconds)
        line(f"{max_velocity:.2f} m/s battery time_to_limit", told["time_to_limit"], truth.to_limit)
        assert truth.drawn / truth.seconds == pytest.approx(told["power"], rel=0.05)
        assert truth.to_limit == pytest.approx(told["time_to_limit"], rel=0.15)


def test_docking_and_charging_are_as_estimated() -> None:
    print("\ndocking: quality, estimated, true")
    for seed in (2, 5, 7):
        told, took = charge(seed)
        for quality in ("docking_time", "docking_energy", "net_power", "charging_time"):
            line(f"seed {seed}, {took.distance:.1f} m: {quality}", told[quality], getattr(took, quality))
        assert took.docking_time == pytest.approx(told["docking_time"], abs=3.0)
        assert took.docking_energy == pytest.approx(told["docking_energy"], abs=20.0)
        assert took.net_power == pytest.approx(told["net_power"], rel=0.02)
        assert took.charging_time == pytest.approx(told["charging_time"], abs=2.0)


@dataclass(frozen=True)
class Exploration:
    """What it took to explore a room: way (m), requests, time (s), and energy (J)."""

    distance: float
    requests: int
    seconds: float
    drawn: float


@pytest.mark.parametrize("strategy", sorted(STRATEGIES))
def test_exploring_in_real_physics_takes_the_way_estimated(strategy: str) -> None:
    print(f"\nexploring, {strategy}: quality, estimated, true")
    done = [_explore(seed, strategy) for seed in SEEDS]
    told = Explorer.estimate({"strategy": strategy}, {})
    distance = sum(each.distance for each in done) / len(done)
    requests = sum(each.requests for each in done) / len(done)
    line("distance", told["distance"], distance)
    line("requests", told["requests"], requests)
    assert distance == pytest.approx(told["distance"], rel=0.5)
    assert requests == pytest.approx(told["requests"], rel=0.5)
    for each in done:
        power = Battery.estimate({}, {"speed": each.distance / each.seconds})["power"]
        line("battery power", power, each.drawn / each.seconds)
        assert each.drawn / each.seconds == pytest.approx(power, rel=0.05)


def _explore(seed: int, strategy: str) -> Exploration:
    with Rig(seed=seed) as rig:
        world = world_on(rig, odometry_travel_noise=TRAVEL_NOISE)
        rig.add(Mapper)
        place = {"odometry": "localization"}
        explorer = rig.add(Explorer, "explorer", {"strategy": strategy}, place)
        rig.add(Navigator, "navigator", connections=place)
        battery = rig.add(Battery)
        truth = rig.collect("ground_truth", GroundTruth)
        pilot = rig.add(Pilot)
        run_until(rig, world, lambda: pilot.done, within=600.0)
        assert pilot.done
        distance = TICK * sum(abs(told.twist.forward) for told in truth)
        requests = round(explorer.evaluate()["requests"])
        return Exploration(distance, requests, truth[-1].stamp, battery.evaluate()["drawn"])


class Pilot(Component):
    """Drives from frontier to frontier until none is left."""

    done = False

    async def _explore(self) -> None:
        reached = True
        while True:
            asked = NextFrontier(unreached=not reached)
            frontier = await self.kit.call("next_frontier", asked, Frontier, timeout=30.0)
            if frontier.goal is None:
                break
            drive = self.kit.goal("navigate_to", NavigateTo(frontier.goal), Arrival, NavigationProgress)
            reached = (await drive.outcome()).arrived
        self.done = True

    def on_activate(self) -> None:
        self.kit.spawn(self._explore(), "explore")


@dataclass(frozen=True)
class Usage:
    """What a process has taken so far: time (s) of a core, and its share of the memory (MiB) it has now."""

    cpu: float
    memory: float


def usage(pid: int) -> Usage:
    """Measure a process; memory that it shares with others counts in part, so that the sum is right (PSS)."""
    times = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    fields = dict(part.split(":") for part in Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()[1:])
    return Usage((int(times[11]) + int(times[12])) / 100.0, float(fields["Pss"].split()[0]) / 1024.0)


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[[str], System]]:
    """Return what starts one of FROG's stacks at the pace of the wall clock; every one is ended with the test."""
    with home(tmp_path / "home"), all_ended() as started:

        def run_stack(name: str) -> System:
            options = ["--system", "tests", "--speed", "real", "--set", "gateway.port=0"]
            started.append(System(FROG / name, *options, log=tmp_path / "up.log"))
            return started[-1]

        yield run_stack


@pytest.mark.parametrize("stack", ["stack.yaml", "search.yaml"])
def test_no_process_takes_more_than_its_class_says_and_no_class_says_nothing(
    stack: str, start: Callable[[str], System]
) -> None:
    system = start(stack)
    _wait_for_time(system, 4.0)
    before, begun = _usages(system), _time(system)
    _wait_for_time(system, begun + MEASURED_FOR)
    after, seconds = _usages(system), _time(system) - begun
    print(f"\n{stack}: share of a core as stated, estimated, measured; MiB as stated, measured")
    silent, greedy = [], []
    for name in sorted(after):
        description = system.client.describe(name)
        needs = description.resources
        cpu, memory = (after[name].cpu - before[name].cpu) / seconds, after[name].memory
        estimated = system.client.qualities(name).estimated.get("cpu", needs.cpu)
        print(f"{name:20} {needs.cpu:6.3f} {estimated:6.3f} {cpu:6.3f}   {needs.memory:6.0f} {memory:6.0f}")
        if not (needs.cpu and needs.memory):
            silent.append(description.cls)
        elif cpu > MARGIN * min(needs.cpu, estimated) or memory > MEMORY_MARGIN * needs.memory:
            greedy.append(name)
    assert (silent, greedy) == ([], [])


def _usages(system: System) -> dict[str, Usage]:
    return {name: usage(process.pid) for name, process in system.processes().items() if process.pid}


def _time(system: System) -> float:
    told = system.client.clock(PATIENCE)
    assert told is not None
    return told.time / 1e9


def _wait_for_time(system: System, seconds: float) -> None:
    wait_until(lambda: _time(system) >= seconds, f"{seconds:g} simulated seconds")
