"""SUAVE's whole mission on schedules drawn from seeds: each disturbance is answered, and equal seeds do alike."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from regraft.stacks.suave.studies.reactions import drawn
from tests.support.paths import SUAVE
from tests.support.running import modes, ran

pytestmark = [pytest.mark.evidence, pytest.mark.timeout(3600)]

SECONDS = 300.0
RECOVERING, RECHARGING = "f_maintain_motion.fd_recover_thrusters", "generate_recharge_path.normal"


def settings(seed: int) -> list[str]:
    """Return the schedule of a seed as settings of a command."""
    parts: dict[str, Any] = drawn(seed)["components"]
    return [
        f"{component}.{name}={json.dumps(value)}"
        for component, part in parts.items()
        for name, value in part["parameters"].items()
    ]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_thrusters_are_recovered_and_the_battery_is_charged_in_equal_runs_alike(tmp_path: Path, seed: int) -> None:
    runs = [ran(SUAVE, tmp_path / str(number), SECONDS, *settings(seed)) for number in range(2)]
    assert runs[0]["digest"] == runs[1]["digest"]
    decided = modes(tmp_path / "0")
    assert 1 <= decided.count(RECOVERING) <= 2
    assert decided.count(RECHARGING) == 1
    assert decided.count("f_maintain_motion.fd_all_thrusters") == decided.count(RECOVERING) + 1
    assert "f_follow_pipeline.fd_follow_pipeline" in decided


def test_the_published_schedule_has_each_altitude_by_the_visibility(tmp_path: Path) -> None:
    ran(SUAVE, tmp_path, SECONDS, "battery_monitor.discharge_time=1e9")
    assert modes(tmp_path) == [
        "f_maintain_motion.fd_all_thrusters",
        "f_generate_search_path.fd_spiral_high",
        "f_generate_search_path.fd_spiral_medium",
        "f_generate_search_path.fd_spiral_low",
        RECOVERING,
        "f_maintain_motion.fd_all_thrusters",
        "f_generate_search_path.fd_spiral_medium",
        "f_generate_search_path.fd_spiral_high",
        "f_generate_search_path.fd_spiral_medium",
        "f_generate_search_path.__DEFAULT__",
        "f_follow_pipeline.fd_follow_pipeline",
    ]
