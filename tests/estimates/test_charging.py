"""What docking and charging take is as estimated, in real physics."""

from __future__ import annotations

import pytest

from .dock import charge

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("seed", [2])
def test_docking_and_charging_take_the_time_and_the_energy_estimated(seed: int) -> None:
    told, done = charge(seed)
    assert done.docking_time == pytest.approx(told["docking_time"], abs=3.0)
    assert done.docking_energy == pytest.approx(told["docking_energy"], abs=20.0)
    assert done.net_power == pytest.approx(told["net_power"], rel=0.02)
    assert done.evaluated_power == pytest.approx(told["net_power"], rel=0.02)
    # What was drawn on the way must be charged as well.
    assert done.charging_time == pytest.approx(told["charging_time"], abs=2.0)
