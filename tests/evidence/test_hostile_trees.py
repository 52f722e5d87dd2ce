"""Ten thousand hostile trees, scripts, rules and requests, while a mission runs."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from tests.hostile.attacked_mission import attacked_mission
from tests.hostile.conftest import Start, start

__all__ = ["start"]

pytestmark = [pytest.mark.evidence, pytest.mark.alone, pytest.mark.timeout(7200)]

INPUTS = int(os.environ.get("REGRAFT_HOSTILE_INPUTS", "10000"))
"""Fewer try the test itself."""
SLICE = 500
SEED = 20261126


def test_a_mission_under_ten_thousand_hostile_inputs_is_neither_restarted_nor_failed_nor_slowed(
    start: Start, tmp_path: Path
) -> None:
    with attacked_mission(start, tmp_path) as mission:
        began = time.monotonic()
        for begin in range(0, INPUTS, SLICE):
            mission.attack(min(SLICE, INPUTS - begin), SEED, begin)
            print("\n".join([*mission.lines(), f"{time.monotonic() - began:.0f} s"]), flush=True)
        assert mission.answers.wrong == []
        mission.check()
