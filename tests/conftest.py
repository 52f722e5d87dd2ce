"""What holds for all tests."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, settings

from sim_service.renderers import RendererName
from tests.renderers import best

# How long an example takes says more about the machine than about the code.
settings.register_profile("tests", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("tests")


@pytest.fixture(params=["ray", "best"])
def renderer(request: pytest.FixtureRequest) -> RendererName:
    """Return the renderer that works everywhere, then the best one of this machine."""
    return "ray" if request.param == "ray" else best()
