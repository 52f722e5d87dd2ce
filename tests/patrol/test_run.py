"""A short patrol in which laser and battery fail: the decisions of the published table, in a run."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from tests.support.commands import run
from tests.support.paths import PATROL, ROOT
from tests.support.running import entered, modes, ran

pytestmark = pytest.mark.slow

PAGE = ROOT / "docs" / "patrol.md"

SETTINGS = (
    "battery.initial_charge=0.6",
    "world.failures=[{at: 8, device: lidar, failure: zeros}, {at: 14, device: lidar, failure: none}]",
    "component_observer.presumed_after=8",
    "battery.drains=[{at: 24, power: 600}, {at: 28, power: 0}]",
    "gateway.port=0",
)


def test_a_laser_of_zeros_and_a_low_battery_have_other_realizations_chosen(tmp_path: Path) -> None:
    ran(PATROL, tmp_path, 34.0, *SETTINGS)
    chosen = modes(tmp_path)
    assert chosen[:3] == ["to_navigate.performance", "to_navigate.degraded", "to_navigate.performance"]
    assert set(chosen[3:]) == {"to_navigate.energy_saving", "to_recharge.at_the_dock"}
    _, laser, recovery, *battery = (at for at, _ in entered(tmp_path))
    assert 8.0 <= laser <= 9.0
    assert 16.0 <= recovery <= 18.0
    assert all(24.0 <= at <= 30.0 for at in battery)


def test_a_rest_is_no_arrival_and_the_round_continues_after_it(tmp_path: Path) -> None:
    summary = ran(
        PATROL,
        tmp_path,
        30.0,
        "world.failures=[{at: 6, device: lidar, failure: silent}, {at: 9, device: lidar, failure: none}]",
        "camera.failures=[{at: 6, failure: black}]",
        "component_observer.presumed_after=6",
        "gateway.port=0",
    )
    assert modes(tmp_path)[:4] == [
        "to_navigate.performance",
        "to_navigate.degraded",
        "to_navigate.__DEFAULT__",
        "to_navigate.performance",
    ]
    assert summary["visits"] == {"place_1": 1}


def test_the_realization_of_the_page_is_chosen_once_it_is_among_the_skills(tmp_path: Path) -> None:
    stack = tmp_path / "patrol"
    shutil.copytree(PATROL, stack)
    (realization,) = re.findall(r"^```text\n(Realization brisk.*?)^```$", PAGE.read_text(), re.MULTILINE | re.DOTALL)
    skills = stack / "patrol.skills"
    skills.write_text(skills.read_text() + realization)
    written = run("skills", "generate", str(skills), "--out", str(stack / "metacontrol"))
    assert written.returncode == 0, written.stderr
    ran(stack, tmp_path / "home", 2.0, "gateway.port=0")
    assert modes(tmp_path / "home") == ["to_navigate.brisk"]
