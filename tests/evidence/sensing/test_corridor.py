"""Ten drives of 32 m down each of three bare corridors: how far the localizer and the mapper are off."""

from __future__ import annotations

import pytest

from tests.mapper.drives import IN_SIGHT, OUT_OF_SIGHT, Drive, down_corridor
from tests.mapper.measuring import ALONG_ROWS, ASKEW, line, localized, mapped, trusted

pytestmark = [pytest.mark.evidence, pytest.mark.timeout(1200)]

SEEDS = range(1, 11)
ALLOWED = 0.4
"""m. The odometry's noise makes 0.04 m of 32 m, as a standard deviation."""


@pytest.fixture(
    scope="module",
    params=[(OUT_OF_SIGHT, ALONG_ROWS), (IN_SIGHT, ALONG_ROWS), (OUT_OF_SIGHT, ASKEW)],
    ids=["endless", "with ends", "askew"],
)
def drives(request: pytest.FixtureRequest) -> list[Drive]:
    """Drive down a corridor with every seed."""
    length, heading = request.param
    return [down_corridor(seed, length, heading) for seed in SEEDS]


def test_on_a_given_map_the_place_is_known_in_ten_of_ten(drives: list[Drive]) -> None:
    found = [localized(drive, drive.ground) for drive in drives]
    print("\n" + line("odometry alone", [trusted(drive) for drive in drives]) + "\n" + line("given map", found))
    assert max(max(each.position) for each in found) <= ALLOWED


def test_a_mapped_corridor_is_as_long_as_the_true_one_in_ten_of_ten(drives: list[Drive]) -> None:
    found = [mapped(drive)[0] for drive in drives]
    print("\n" + line("mapping", found))
    assert max(abs(each.ahead) for each in found) <= ALLOWED
