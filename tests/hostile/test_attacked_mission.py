"""A mission runs while hostile trees, scripts, rules and requests are sent: it is as if nobody had sent them."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.hostile.attacked_mission import attacked_mission
from tests.hostile.conftest import Start

pytestmark = pytest.mark.slow

INPUTS = 150


def test_a_mission_under_hostile_input_is_neither_restarted_nor_failed_nor_slowed(start: Start, tmp_path: Path) -> None:
    with attacked_mission(start, tmp_path) as mission:
        mission.attack(INPUTS, seed=1)
        print("\n".join(mission.lines()))
        assert mission.answers.wrong == []
        mission.check()
