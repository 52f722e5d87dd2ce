"""Promises of the simulated world as a component."""

import numpy as np
import pytest

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.geometry import Twist
from regraft.bus_schema.messages.sensors import LaserScan, LightLevel, Odometry
from regraft.bus_schema.messages.world import GroundTruth, WorldState
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.runtime.lifecycle.lifecycle import TransitionFailed
from regraft.sim_service.world import World
from regraft.testing import Rig

from .rigs import run, world_on


def test_odometry_comes_every_tick_and_scans_five_times_a_second() -> None:
    with Rig(seed=3) as rig:
        world = world_on(rig)
        odometry = rig.collect("odometry", Odometry)
        scans = rig.collect("scan", LaserScan)
        run(rig, world, 2.0)
    assert [round(message.stamp, 3) for message in odometry] == [round(0.05 * n, 3) for n in range(1, 41)]
    assert len(scans) == 10
    assert scans[0].ranges.shape == (360,)
    assert np.isfinite(scans[0].ranges).any()


def test_odometry_begins_where_the_robot_really_starts() -> None:
    with Rig(seed=3) as rig:
        world = world_on(rig)
        odometry, truth = rig.collect("odometry", Odometry), rig.collect("ground_truth", GroundTruth)
        run(rig, world, 0.5)
    assert odometry[0].frame == "odom"
    assert odometry[-1].pose.x == pytest.approx(truth[-1].pose.x, abs=0.005)
    assert odometry[-1].pose.yaw == pytest.approx(truth[-1].pose.yaw, abs=0.02)


def test_robot_follows_velocity_and_stops_when_commands_stay_away() -> None:
    with Rig(seed=3) as rig:
        world = world_on(rig)
        truth = rig.collect("ground_truth", GroundTruth)
        rig.publish("velocity", Twist.planar(0.0, 0.5))
        run(rig, world, 0.4)
        turning = truth[-1].twist.turn
        run(rig, world, 0.6)
    assert turning == pytest.approx(0.5, abs=0.05)
    assert abs(truth[-1].twist.turn) < 0.02


def test_world_state_is_published_only_for_somebody_and_carries_the_light() -> None:
    with Rig(seed=3) as rig:
        world = world_on(rig)
        assert not world.world_state.wanted
        run(rig, world, 0.1)
        states = rig.collect("world_state", WorldState)
        rig.publish("light", LightLevel(0.0, 0.75))
        run(rig, world, 0.1)
    assert [state.tick for state in states] == [3, 4]
    assert states[-1].light == pytest.approx(0.25)
    assert states[-1].seed == 3


def test_contacts_are_counted_and_told() -> None:
    with Rig(seed=3) as rig:
        world = world_on(rig)
        truth = rig.collect("ground_truth", GroundTruth)
        for _ in range(500):
            rig.publish("velocity", Twist.planar(0.26, 0.0))
            run(rig, world, 0.05)
    assert truth[-1].contacts >= 1
    assert truth[-1].touching
    assert any(event.kind == "world.contact" for event in rig.events)


def continued(rig: Rig, world: World) -> list[bytes]:
    """Drive on, and return everything that is published, as it travels."""
    truth, scans = rig.collect("ground_truth", GroundTruth), rig.collect("scan", LaserScan)
    for n in range(40):
        rig.publish("velocity", Twist.planar(0.2, 0.1 * (n % 7)))
        run(rig, world, 0.05)
    return [codec.encode(message) for message in (*truth, *scans)]


def test_a_world_continued_from_its_checkpoint_goes_on_identically() -> None:
    with Rig(seed=3) as rig:
        world = world_on(rig, odometry_travel_noise=0.01)
        continued(rig, world)
        checkpoint = codec.encode(rig.runtimes["world"].checkpoints.snapshot())
        expected = continued(rig, world)
    with Rig(seed=3, start=2.0) as rig:
        successor = world_on(rig, odometry_travel_noise=0.01)
        successor.restore(codec.unpack_plain(checkpoint)["state"])
        assert continued(rig, successor) == expected


def test_equal_seeds_give_equal_worlds_and_others_do_not() -> None:
    runs = []
    for seed in (3, 3, 4):
        with Rig(seed=seed) as rig:
            runs.append(continued(rig, world_on(rig)))
    assert runs[0] == runs[1]
    assert runs[0] != runs[2]


def test_a_missing_world_file_is_named() -> None:
    with Rig() as rig:
        rig.add(World, parameters={"file": "/nowhere/world.xml"}, state=State.UNCONFIGURED)
        with pytest.raises(TransitionFailed, match=r"/nowhere/world\.xml: no such world file"):
            rig.transition("world", Transition.CONFIGURE)
        assert len(rig.take_faults()) == 1
