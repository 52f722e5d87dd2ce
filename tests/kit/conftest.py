"""The site, on both buses."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.support.stepped.site import Site


@pytest.fixture(params=["memory", "zenoh"])
def site(request: pytest.FixtureRequest) -> Iterator[Site]:
    """A bus of either kind, with nothing on it yet."""
    made = Site(request.param)
    yield made
    made.close()
