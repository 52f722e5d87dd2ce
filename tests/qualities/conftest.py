"""Two systems of gauges: one under the real clock, one under simulated time."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.support.systems import System, home

REAL = """\
system: tests
clock: real
components:
  gauge: {class: tests.qualities.parts:Gauge}
  broken: {class: tests.qualities.parts:Gauge, parameters: {mood: raises}}
  asleep: {class: tests.qualities.parts:Gauge, state: inactive}
  busy: {class: tests.qualities.parts:Busy}
  plain: {class: tests.qualities.parts:Plain}
  listener: {class: tests.qualities.parts:Listener}
"""


@pytest.fixture(scope="module")
def system(tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    """Run the gauges under the real clock for all tests of a module."""
    folder = tmp_path_factory.mktemp("gauges")
    (folder / "stack.yaml").write_text(REAL)
    with home(folder / "home"):
        made = System(folder / "stack.yaml")
        yield made
        made.end()
