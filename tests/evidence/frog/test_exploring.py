"""FROG's room is explored whole, and all that stands in it is found, wherever it stands: 20 seeds, both strategies."""

from __future__ import annotations

import math

import numpy as np
import pytest

from regraft.bus_schema.messages.maps import Goals
from regraft.services.explorer.strategies import STRATEGIES
from regraft.services.obstacles.obstacles import Obstacles
from regraft.sim_service import survey
from regraft.sim_service.simulation import Simulation
from regraft.testing import Rig
from tests.explorer.rooms import frog_room
from tests.explorer.tour import Tour
from tests.obstacles.test_obstacles import ahead_of
from tests.support.worlds import frog_scene, truth_of

pytestmark = [pytest.mark.evidence, pytest.mark.timeout(3600)]


@pytest.mark.parametrize("strategy", sorted(STRATEGIES))
def test_twenty_rooms_are_explored_and_all_their_objects_found(strategy: str) -> None:
    scene = frog_scene()
    complete = 0
    print(f"\n{strategy}\nseed requests way/m unseen/m2 objects goals missed")
    for seed in range(1, 21):
        simulation = Simulation(scene, seed)
        start = truth_of(simulation).pose
        with Rig() as rig:
            obstacles, told = rig.add(Obstacles), rig.collect("goals", Goals)
            tour = Tour(rig, frog_room(simulation), (start.x, start.y), 0.01, strategy=strategy)
            tour.explore(look_on_the_way=True)
            rig.publish("map", tour.mapped.message(rig.clock.now() / 1e9))
            rig.advance(2.0)
            found = obstacles.evaluate()
        faced = [ahead_of(tour.room.grid(), goal.pose.pose) for goal in told[-1].goals]
        true = [ahead_of(tour.room.grid(), goal.pose) for goal in survey.goals(simulation)]
        missed = sum(min(math.dist(point, other) for other in faced) > 0.45 for point in true)
        unseen = float(np.round(tour.unseen(), 3))
        counts = f"{found['objects']:7.0f} {found['goals']:5.0f} {missed:6d}"
        print(f"{seed:4d} {len(tour.answers):8d} {tour.distance:5.1f} {unseen:9.3f} {counts}")
        complete += missed == 0 and unseen == 0.0
    assert complete >= 18
