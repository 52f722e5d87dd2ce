"""Whole runs of FROG in which it is adapted: equal runs stay equal."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.frog.changes import (
    CAMERA,
    DETECTOR,
    NO_EXPLORER,
    NO_SECOND_DETECTOR,
    PURSUIT,
    ROLLOUTS,
    SECOND_DETECTOR,
    swap,
)
from tests.frog.scripted import applied, scripted, twice

pytestmark = pytest.mark.slow

OTHERS = ("camera", "corner_camera", "map_server", "battery", "lighting", "reflection", "detector")


def test_equal_runs_in_which_everybody_is_swapped_and_a_component_comes_and_goes_are_equal(tmp_path: Path) -> None:
    script = [
        [3.0, [SECOND_DETECTOR], "corner_detect"],
        [4.0, [swap("navigator", PURSUIT)], ""],
        [5.0, [swap(name) for name in OTHERS], ""],
        [6.0, [NO_SECOND_DETECTOR], ""],
        [7.03, [swap("recorder"), swap("bt_executor")], ""],
        [8.0, [SECOND_DETECTOR], "corner_detect"],
        [9.0, [swap("navigator", ROLLOUTS)], ""],
    ]
    run = twice(tmp_path, "stack.yaml", 12, script)
    assert run.summary["ticks"] == 240
    assert run.summary["adaptations"]["applied"] == len(script)
    assert run.summary["contacts"] == 0
    assert run.summary["distance"] > 1.0


def test_from_exploring_to_detecting_in_one_adaptation(tmp_path: Path) -> None:
    script = [[5.0, [NO_EXPLORER, CAMERA, DETECTOR], "detect"]]
    run = applied(*scripted(tmp_path / "run", "explore.yaml", 8, script), script)
    assert run.code == 0, run.errors
