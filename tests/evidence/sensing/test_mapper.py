"""Five rooms, five minutes each, on wheels that slip: where the mappers say the robot is, and what they have mapped.

The robot is steered by the truth, so that both mappers see the same drive.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from time import process_time

import numpy as np
import pytest

from regraft.evaluation.map_quality import map_quality
from regraft.services.mapper.component import MappingComponent
from regraft.services.mapper.mapper import Mapper
from regraft.services.mapper.mapping import GridSettings, Mapping
from regraft.services.mapper.matching.localizer import Localizer, MatchingLocalizer, TrustingLocalizer
from regraft.services.mapper.odometry_mapper import OdometryMapper
from tests.mapper.drives import TRAVEL_NOISE, Moment, through_frog

pytestmark = [pytest.mark.evidence, pytest.mark.timeout(1200)]

SEEDS = range(1, 6)
SECONDS = 300.0


@dataclass
class Passenger:
    """A mapper on board, and how it did."""

    localizer: Localizer
    errors: list[float] = field(default_factory=list)
    costs: list[float] = field(default_factory=list)
    iou: float = 0.0

    def __post_init__(self) -> None:
        self.mapping = Mapping(GridSettings(), self.localizer)

    def ride(self, moment: Moment) -> None:
        """Take in what the sensors say."""
        begun = process_time()
        place = moment.ride(self.mapping)
        if moment.ranges is not None:
            self.costs.append(process_time() - begun)
        self.errors.append(place.distance(moment.truth))


@dataclass
class Trip:
    """One seed's drive."""

    mappers: dict[type[MappingComponent], Passenger]
    distance: float


def drive(seed: int) -> Trip:
    """Drive from goal to goal with both mappers on board."""
    driven = through_frog(seed, SECONDS)
    trip = Trip(
        {Mapper: Passenger(MatchingLocalizer()), OdometryMapper: Passenger(TrustingLocalizer())}, driven.distance
    )
    ground, start = driven.ground, driven.moments[0].truth
    for passenger in trip.mappers.values():
        for moment in driven.moments:
            passenger.ride(moment)
        grid = passenger.mapping.grid
        assert grid is not None
        true_map = (ground.cells, ground.resolution, (ground.x, ground.y))
        place = (start.x, start.y)
        found = map_quality(grid.per_cent(), grid.resolution, (grid.x, grid.y), *true_map, start=place)
        passenger.iou = found.iou
    return trip


@pytest.fixture(scope="module")
def trips() -> dict[int, Trip]:
    """Drive every seed once, and print a line for each mapper."""
    made = {seed: drive(seed) for seed in SEEDS}
    for seed, trip in made.items():
        for cls, passenger in trip.mappers.items():
            errors, costs = np.array(passenger.errors), 1e3 * np.array(passenger.costs)
            print(
                f"seed {seed} {trip.distance:4.1f} m, {cls.__name__:14} error at the end "
                f"{errors[-1]:.3f}, mean {errors.mean():.3f}, worst {errors.max():.3f} m, IoU {passenger.iou:.3f}, "
                f"ms per scan {costs.mean():.2f}, 95 % within {np.percentile(costs, 95):.2f}"
            )
    return made


def test_the_place_is_known_to_a_decimetre_all_the_time(trips: dict[int, Trip]) -> None:
    for seed, trip in trips.items():
        assert max(trip.mappers[Mapper].errors) <= 0.10, seed


def test_the_map_covers_nine_tenths_of_the_room(trips: dict[int, Trip]) -> None:
    for seed, trip in trips.items():
        assert trip.mappers[Mapper].iou >= 0.9, seed


def test_the_odometry_alone_is_clearly_worse(trips: dict[int, Trip]) -> None:
    for seed, trip in trips.items():
        alone = trip.mappers[OdometryMapper]
        assert max(alone.errors) > 2.0 * 0.10, seed
        assert alone.iou < 0.7, seed


def test_the_estimates_are_of_the_right_size(trips: dict[int, Trip]) -> None:
    for cls in (Mapper, OdometryMapper):
        context = {"travel_noise": TRAVEL_NOISE, "distance": float(np.mean([t.distance for t in trips.values()]))}
        expected = cls.estimate({}, context)
        errors = float(np.mean([np.mean(trip.mappers[cls].errors) for trip in trips.values()]))
        quality = float(np.mean([trip.mappers[cls].iou for trip in trips.values()]))
        assert errors / 2.5 <= expected["pose_error"] <= errors * 2.5, cls
        assert expected["map_quality"] == pytest.approx(quality, abs=0.15), cls
