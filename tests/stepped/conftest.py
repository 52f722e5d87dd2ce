"""The site in step, on both buses."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.support.stepped.step_site import StepSite


@pytest.fixture(params=["memory", "zenoh"])
def steps(request: pytest.FixtureRequest) -> Iterator[StepSite]:
    """A bus of either kind, with nothing on it yet."""
    made = StepSite(request.param)
    yield made
    made.close()
