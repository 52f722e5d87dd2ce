"""Promises about runs as a whole: repeatable, continued from snapshots, honest about contacts."""

import math

import msgpack
import numpy as np
import pytest

from regraft.sim_service.simulation import Simulation, SnapshotError
from tests.support.worlds import new_contacts, send_command, touched_by, turn_of

from .worlds import drive, frog, frog_with_robot_at

NOISY = frog(odometry={"travel_noise": 0.01})


def wander(simulation: Simulation, ticks: int) -> list[str]:
    """Drive about, with changing light, and return the digest of every tick."""
    digests = []
    for _ in range(ticks):
        phase = simulation.time
        send_command(simulation, 0.2 * math.sin(phase), math.cos(1.7 * phase))
        simulation.set_light(0.5 + 0.5 * math.cos(phase))
        simulation.advance(simulation.settings.tick)
        digests.append(simulation.digest() + str(turn_of(simulation).ranges.sum()))
    return digests


def test_same_seed_same_run() -> None:
    assert wander(Simulation(NOISY, 5), 100) == wander(Simulation(NOISY, 5), 100)


def test_another_seed_another_run() -> None:
    assert wander(Simulation(frog(), 5), 10)[-1] != wander(Simulation(frog(), 6), 10)[-1]


def test_a_restored_run_continues_bit_by_bit() -> None:
    original = Simulation(NOISY, 5)
    wander(original, 37)
    packed = msgpack.packb(original.snapshot())
    expected = wander(original, 80)
    successor = Simulation(NOISY, 99)
    successor.restore(msgpack.unpackb(packed))
    assert wander(successor, 80) == expected
    assert successor.snapshot() == original.snapshot()


def test_a_snapshot_between_two_ticks_continues_too() -> None:
    original = Simulation(frog(), 5)
    wander(original, 10)
    original.advance(0.014)
    successor = Simulation(frog(), 5)
    successor.restore(original.snapshot())
    for simulation in (original, successor):
        simulation.advance(0.036)
    assert wander(successor, 20) == wander(original, 20)


def test_one_long_advance_equals_many_short_ones() -> None:
    long, short = Simulation(frog(), 5), Simulation(frog(), 5)
    long.advance(1.0)
    for _ in range(20):
        short.advance(0.05)
    assert long.digest() == short.digest()


def test_snapshot_of_another_version_or_world_is_refused() -> None:
    simulation = Simulation(frog(), 5)
    snapshot = simulation.snapshot()
    with pytest.raises(SnapshotError, match="version 99"):
        simulation.restore({**snapshot, "version": 99})
    with pytest.raises(SnapshotError, match="another world"):
        simulation.restore({**snapshot, "world": "0"})


def test_time_passes_in_whole_physics_steps_only() -> None:
    simulation = Simulation(frog(), 5)
    with pytest.raises(ValueError, match="whole number of physics steps"):
        simulation.advance(0.003)
    simulation.advance(0.25)
    assert simulation.time == pytest.approx(0.25)


def test_driving_into_a_box_is_one_contact_with_its_name() -> None:
    simulation = frog_with_robot_at(-0.5, 0.463, math.pi)
    drive(simulation, 0.2, 0.0, 1.0)
    assert touched_by(simulation) == frozenset()
    drive(simulation, 0.2, 0.0, 4.0)
    assert touched_by(simulation) == {"west_box"}
    events = new_contacts(simulation)
    assert [event.body for event in events] == ["west_box"]
    assert 2.0 < events[0].time < 4.0
    assert new_contacts(simulation) == ()


def test_touching_again_later_is_another_contact() -> None:
    simulation = frog_with_robot_at(-0.85, 0.463, math.pi)
    for _ in range(2):
        drive(simulation, 0.2, 0.0, 2.0)
        drive(simulation, -0.1, 0.0, 1.5)
    assert [event.body for event in new_contacts(simulation)] == ["west_box", "west_box"]


def test_render_state_is_a_copy() -> None:
    simulation = frog_with_robot_at(0.0, -1.0, 0.0)
    state = simulation.render_state()
    before = state.qpos.copy()
    drive(simulation, 0.2, 0.0, 1.0)
    np.testing.assert_array_equal(state.qpos, before)


@pytest.mark.parametrize("level", [-0.1, 1.1, math.nan])
def test_light_level_out_of_range_is_refused(level: float) -> None:
    with pytest.raises(ValueError, match="light level"):
        Simulation(frog(), 5).set_light(level)


def test_pushing_a_wall_is_one_lasting_contact() -> None:
    simulation = frog_with_robot_at(2.0, -0.5, 0.0)
    drive(simulation, 0.26, 0.0, 3.0)
    for _ in range(20):
        drive(simulation, 0.26, 0.0, 0.25)
        assert touched_by(simulation) == {"walls"}
    assert [event.body for event in new_contacts(simulation)] == ["walls"]
