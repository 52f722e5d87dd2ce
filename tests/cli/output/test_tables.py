"""Texts that people read of a real system: every list and every adaptation, without `--json`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.cli.live import STACK, System, regraft

MODES = """
modes:
  loud: [{change: set_parameters, component: talker, parameters: {step: 2}}]

components:
  bandits: {class: 'regraft.adaptation_manager.planners.bandits.bandit_planner:BanditPlanner', parameters: {seed: 7}}
"""


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    """Run the tiny stack with a mode and a planner."""
    folder = tmp_path_factory.mktemp("robot")
    text = (STACK / "stack.yaml").read_text().replace("\ncomponents:\n", MODES)
    (folder / "stack.yaml").write_text(text)
    (folder / "tiny_parts.py").write_text((STACK / "tiny_parts.py").read_text())
    with System(folder / "home", command=("up", str(folder), "--headless")) as system:
        yield system


def shown(robot: System, *arguments: str) -> list[list[str]]:
    """Return the cells of what a command prints, line by line."""
    done = regraft(robot.home, *arguments)
    assert (done.returncode, done.stderr) == (0, "")
    return [[cell.strip() for cell in line.split("  ") if cell.strip()] for line in done.stdout.splitlines()]


@pytest.mark.parametrize(
    ("command", "heading", "row"),
    [
        (
            "param list talker",
            ["component", "parameter", "value", "range", "unit"],
            ["talker", "rate", "20.0", "1.0 .. 100.0", "Hz", "how often"],
        ),
        (
            "topic list",
            ["topic", "type", "carried", "written by", "read by"],
            ["number", "clitest/Number", "reliable, 20 Hz", "talker", "listener"],
        ),
        (
            "service list",
            ["service", "component", "request", "reply"],
            ["last_number", "listener", "clitest/NumberRequest", "clitest/Number"],
        ),
        (
            "action list",
            ["action", "component", "request", "reply", "goals"],
            ["wait_for", "listener", "clitest/Number", "clitest/Number", "1"],
        ),
        (
            "lifecycle list listener",
            ["component", "state", "transitions"],
            ["listener", "active", "deactivate, shutdown"],
        ),
        ("mode", ["mode", "in force", "asked for", "reachable"], ["loud", "yes"]),
        ("planner list", ["planner", "component", "strategy", "knobs"], ["bandits", "bandits", "ucb1"]),
        ("estimate listener", ["listener estimates no qualities"], []),
    ],
)
def test_a_list_has_a_heading_and_a_row_for_each(
    robot: System, command: str, heading: list[str], row: list[str]
) -> None:
    first, *rows = shown(robot, *command.split())
    assert first == heading
    assert not row or row in [found[: len(row)] for found in rows]


def test_an_adaptation_is_told_with_who_why_what_and_how(robot: System) -> None:
    change = "param", "set", "talker", "step=3", "--reason", "to see"
    (headline,) = shown(robot, *change)[0]
    assert headline.startswith("adaptation ")
    number, (before, after) = headline.split()[1], headline.partition("revision ")[2].split(",")[0].split(" to ")
    assert any(row[0] == number and row[-1] == "to see" for row in shown(robot, "journal"))
    told = [" ".join(cells) for cells in shown(robot, "journal", "show", number)]
    assert told[0] == headline
    assert told[1].endswith(", because: to see")
    assert "set_parameters: component talker, parameters {'step': 3}" in told
    assert any(line.startswith("1. talker: ") and ": done" in line for line in told)
    difference = "/components/talker/parameters/step: "
    assert any(line.startswith((f"+ {difference}", f"~ {difference}")) for line in told)
    differing = [" ".join(cells) for cells in shown(robot, "journal", "diff", before, after)]
    assert differing == [f"revision {before} to {after}", told[-1]]


def test_a_mode_in_force_is_told(robot: System, tmp_path: Path) -> None:
    shown(robot, "mode", "loud")
    assert ["loud", "yes", "yes", "yes"] in shown(robot, "mode")
