"""Promises of the mappers in the simulated world of FROG."""

from __future__ import annotations

import math

import pytest

from regraft.bus_schema.messages.geometry import Twist
from regraft.bus_schema.messages.maps import OccupancyGrid
from regraft.bus_schema.messages.sensors import Odometry
from regraft.bus_schema.messages.world import GroundTruth
from regraft.evaluation.map_quality import map_quality
from regraft.services.mapper.component import MappingComponent
from regraft.sim_service import survey
from regraft.testing import Rig
from tests.services.rigs import run, world_on

from .room import MAPPERS


@pytest.mark.parametrize("cls", MAPPERS, ids=lambda cls: cls.__name__)
def test_what_the_robot_sees_of_its_room_is_mapped_rightly(cls: type[MappingComponent]) -> None:
    with Rig(seed=1) as rig:
        world = world_on(rig)
        rig.add(cls, "mapper")
        maps, places = rig.collect("map", OccupancyGrid), rig.collect("localization", Odometry)
        truth = rig.collect("ground_truth", GroundTruth)
        for _ in range(24):
            rig.publish("velocity", Twist.planar(0.0, 0.8))
            run(rig, world, 0.4)
        place, true_pose = places[-1].pose, truth[-1].pose
        assert math.hypot(place.x - true_pose.x, place.y - true_pose.y) < 0.05
        ground, made = survey.ground_map(world.simulation), maps[-1]
        found = map_quality(
            made.cells,
            made.resolution,
            (made.origin.x, made.origin.y),
            ground.occupancy,
            ground.resolution,
            ground.origin,
            start=(true_pose.x, true_pose.y),
        )
        # From one place it sees most of the room, and what it sees is where it is.
        assert found.iou > 0.6, found
