"""How far it is to explore a room, and how often to ask, is as estimated; in real physics: tests/evidence."""

from __future__ import annotations

import pytest

from regraft.services.explorer.explorer import Explorer
from regraft.services.explorer.strategies import STRATEGIES
from regraft.sim_service.simulation import Simulation
from regraft.testing import Rig
from tests.explorer.rooms import frog_room
from tests.explorer.tour import Tour
from tests.support.worlds import frog_scene, truth_of


@pytest.mark.parametrize("strategy", sorted(STRATEGIES))
def test_exploring_takes_the_way_and_the_requests_estimated_and_told(strategy: str) -> None:
    scene = frog_scene()
    tours = []
    for seed in (1, 2):
        simulation = Simulation(scene, seed)
        start = truth_of(simulation).pose
        with Rig() as rig:
            tour = Tour(rig, frog_room(simulation), (start.x, start.y), 0.01, strategy=strategy)
            tour.explore(15, look_on_the_way=True)
            told = tour.explorer.evaluate()
            assert told["requests"] == len(tour.answers)
            assert told["distance"] == pytest.approx(tour.distance, rel=0.25)
            assert told["frontiers_left"] == 0.0
            tours.append(told)
    estimate = Explorer.estimate({"strategy": strategy}, {})
    for quality, estimated in estimate.items():
        assert sum(told[quality] for told in tours) / len(tours) == pytest.approx(estimated, rel=0.5), quality
