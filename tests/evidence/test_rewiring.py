"""Rewiring at 1 kHz under the real clock, on a loaded machine: nothing lost, doubled or out of order."""

from __future__ import annotations

import pytest

from benchmarks.adapting.rewire import rewire
from benchmarks.harness import Effort
from tests.support.frog import Load

pytestmark = [pytest.mark.evidence, pytest.mark.alone, pytest.mark.timeout(900)]


@pytest.mark.parametrize("busy", [0, 2])
def test_rewiring_loses_no_message_at_1_khz(busy: int) -> None:
    with Load(busy):
        results = rewire(Effort(1, 1.0))
    for result in results:
        print(result.name, result.figure, result.note)
    assert len(results) == 9
    assert all(result.figure == 0 for result in results)
