"""The site in step, on both buses."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from regraft.lockstep import markers, step_dispatch
from tests.support.stepped.step_site import StepSite
from tests.support.waiting import PATIENCE


@pytest.fixture(params=["memory", "zenoh"])
def steps(request: pytest.FixtureRequest) -> Iterator[StepSite]:
    """A bus of either kind, with nothing on it yet."""
    made = StepSite(request.param)
    yield made
    made.close()


@pytest.fixture
def steps_sent_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Send no step again only because its member is slow to acknowledge it."""
    monkeypatch.setattr(step_dispatch, "STEP_INTERVAL", PATIENCE)


@pytest.fixture
def all_sent_once(monkeypatch: pytest.MonkeyPatch, steps_sent_once: None) -> None:
    """Send no marker again either, on a bus that loses none."""
    monkeypatch.setattr(markers, "MARK_INTERVAL", PATIENCE)
