"""Where several sightings say that something is."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft.bus_schema.messages.geometry import Vector3
from regraft.bus_schema.messages.perception import Detection
from regraft.services.detector.location import locate, weighted_median


def seen(x: float, y: float, confidence: float = 0.9, distance: float = 1.0, frame: str = "map") -> Detection:
    return Detection("hydrant", confidence, frame, Vector3(x, y), 0.0, distance)


def test_without_a_sighting_it_is_nowhere() -> None:
    assert locate([]) is None


def test_one_sighting_is_believed_but_tells_no_spread() -> None:
    place = locate([seen(1.0, 2.0)])
    assert place is not None
    assert (place.position, place.spread) == (Vector3(1.0, 2.0), None)


def test_one_that_is_wrong_does_not_move_it() -> None:
    place = locate([seen(1.0, 2.0), seen(1.02, 2.0), seen(0.98, 2.01), seen(-1.5, 0.3)])
    assert place is not None
    assert math.dist((place.position.x, place.position.y), (1.0, 2.0)) < 0.03
    assert place.spread is not None
    assert place.spread < 0.05


def test_near_and_sure_sightings_weigh_more() -> None:
    place = locate([seen(1.0, 0.0, 0.9, 0.5), seen(1.3, 0.0, 0.3, 2.5), seen(1.4, 0.0, 0.3, 2.5)])
    assert place is not None
    assert place.position.x == 1.0


def test_sightings_in_the_map_count_before_those_in_the_robots_frame() -> None:
    place = locate([seen(0.4, 0.0, frame="base_link"), seen(1.0, 0.0), seen(0.5, 0.0, frame="base_link")])
    assert place is not None
    assert (place.frame, place.position.x) == ("map", 1.0)


@given(st.lists(st.integers(-50, 50), min_size=1, max_size=9))
def test_with_equal_weights_it_is_the_median(values: list[int]) -> None:
    array = np.array(values, float)
    assert weighted_median(array, np.ones(len(values))) == pytest.approx(float(np.median(array)))
