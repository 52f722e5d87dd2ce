"""All three of SUAVE's contingencies in one short mission: what is decided, in which order."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.paths import SUAVE
from tests.support.running import modes, ran

pytestmark = pytest.mark.slow

SHORT = (
    "water_visibility_observer_node.water_visibility_period=16",
    "thruster_monitor.thruster_events=[{thruster: 4, at: 6}]",
    "f_maintain_motion_node.takes=2",
    "battery_monitor.discharge_time=16",
    "generate_recharge_path_node.travel_time=2",
    "detect_pipeline.area=8.5",
)
"""The mission and its contingencies, in a tenth of the time."""
DECISIONS = [
    "f_maintain_motion.fd_all_thrusters",
    "f_generate_search_path.fd_spiral_high",
    "f_generate_search_path.fd_spiral_medium",
    "f_maintain_motion.fd_recover_thrusters",  # in one adaptation with the next
    "f_generate_search_path.fd_spiral_low",
    "f_maintain_motion.fd_all_thrusters",
    "f_generate_search_path.fd_spiral_medium",
    "f_generate_search_path.__DEFAULT__",
    "generate_recharge_path.normal",
    "generate_recharge_path.__DEFAULT__",
    "f_generate_search_path.fd_spiral_high",
    "f_generate_search_path.__DEFAULT__",
    "f_follow_pipeline.fd_follow_pipeline",
]


def test_murky_water_a_failed_thruster_and_a_low_battery_are_answered_in_equal_runs_alike(tmp_path: Path) -> None:
    runs = [ran(SUAVE, tmp_path / str(number), 20.0, *SHORT) for number in range(2)]
    assert runs[0]["digest"] == runs[1]["digest"]
    assert modes(tmp_path / "0") == DECISIONS
