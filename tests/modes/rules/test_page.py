"""The page on modes: its rules are read, and its tables have what a running system shows."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.stack import load
from tests.docs.test_docs import blocks
from tests.modes.stacks import MODES, REAL, SIMULATED, STACK, write
from tests.support.commands import in_home, run
from tests.support.paths import ROOT
from tests.support.systems import System
from tests.support.waiting import wait_until

PAGE = ROOT / "docs" / "modes.md"
STEADY = REAL.replace("failures: 1000", "failures: 1, recovers_after: 1000.0")


def test_the_rules_of_the_page_are_rules_of_a_stack(tmp_path: Path) -> None:
    (rules,) = blocks(PAGE, "yaml")
    found = load(write(tmp_path, STACK + MODES + rules)).architecture.mode_rules
    assert [rule.when for rule in found] == [
        rule.when for rule in load(write(tmp_path, SIMULATED)).architecture.mode_rules
    ]


def test_the_commands_of_the_page_show_what_it_shows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path / "home"))
    system = System(write(tmp_path, STEADY))
    try:

        def lines(*words: str) -> list[list[str]]:
            done = run(*words, environment=in_home(tmp_path / "home"))
            return [line.split() for line in done.stdout.splitlines()]

        wait_until(lambda: system.said("adaptation.applied", "adaptation_manager"), "the degraded mode")
        for console in blocks(PAGE, "console"):
            command: list[str] = []
            shown: list[list[str]] = []
            for line in console.splitlines():
                if line.startswith("$ regraft "):
                    command = line.split()[2:]
                    shown = lines(*command)
                elif line != "...":
                    assert line.split() in shown, (command, shown)
    finally:
        system.end()
