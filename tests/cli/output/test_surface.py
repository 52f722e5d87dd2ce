"""The commands, arguments and options stand in a file: whoever changes them changes it too, knowingly."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer

from tests.cli.app import whole
from tests.cli.conftest import Regraft
from tests.support.paths import ROOT

SURFACE = Path(__file__).parent / "surface.txt"
DOCUMENTED = ROOT / "docs" / "commands.md"


def surface(command: Any, path: str) -> Iterator[str]:
    """Yield a line per command: its arguments, then its options."""
    names = []
    for parameter in command.params:
        if parameter.param_type_name == "argument":
            names.append(parameter.metavar or parameter.name.upper())
        else:
            names.append("/".join(parameter.opts))
    yield " ".join((path, *names))
    for name, part in getattr(command, "commands", {}).items():
        yield from surface(part, f"{path} {name}")


def test_commands_and_options_are_those_that_were_promised() -> None:
    found = list(surface(typer.main.get_command(whole()), "regraft"))
    assert found == SURFACE.read_text().splitlines()


def words(line: str) -> list[str]:
    """Return the names of a command in a line of the surface."""
    return [word for word in line.split()[1:] if word.islower() and not word.startswith("-")]


def test_every_command_has_help(regraft: Regraft) -> None:
    lines = SURFACE.read_text().splitlines()
    assert [line for line in lines if regraft(*words(line), "--help").exit_code != 0] == []


def is_documented(line: str) -> bool:
    """Tell whether the page of the commands has a row for a command."""
    rows = [text for text in DOCUMENTED.read_text().splitlines() if text.startswith("| `regraft ")]
    group, *command = words(line) or ["up"]
    return any(
        f"`regraft {group}" in row and all(f"{name}`" in row or f" {name} " in row for name in command) for row in rows
    )


def test_every_command_is_documented() -> None:
    assert [line for line in SURFACE.read_text().splitlines() if not is_documented(line)] == []


def test_help_lists_the_exit_codes(regraft: Regraft) -> None:
    shown = regraft("--help").output
    for code in ("0", "1", "2", "3", "130"):
        assert f"\n    {code} " in shown or f"\n  {code} " in shown


ABOUT_NO_SYSTEM = {
    "regraft certificates FOLDER NAME...",
    "regraft decision check FILE",
    "regraft decision show FILE",
    "regraft doctor",
    "regraft evaluate claims STUDY",
    "regraft evaluate join FILE...",
    "regraft evaluate run STUDY",
    "regraft evaluate tables PAGE...",
    "regraft evaluate verify FILE",
    "regraft mission check FILE",
    "regraft mission convert FILE",
    "regraft mission dot FILE",
    "regraft mission dry-run FILE",
    "regraft mission models",
    "regraft mission replay RECORDING",
    "regraft skills check FILE",
    "regraft skills count FILE",
    "regraft skills generate FILE",
    "regraft skills kb query FILE...",
    "regraft skills kb save FILE...",
    "regraft skills outline FILE",
    "regraft skills server",
    "regraft stack check STACK",
    "regraft stack show STACK",
    "regraft stack graph STACK",
}


def test_every_command_about_a_system_takes_its_name_as_the_help_says() -> None:
    commands = list(surface(typer.main.get_command(whole()), "regraft"))
    groups = {line for line in commands if any(other.startswith(f"{line} ") for other in commands)}
    without = {line.partition(" --")[0] for line in commands if "--system" not in line and line not in groups}
    assert without == ABOUT_NO_SYSTEM


@pytest.mark.parametrize("before", [(), ("--system", "one")])
def test_a_system_is_not_named_twice_differently(regraft: Regraft, before: tuple[str, ...]) -> None:
    found = regraft(*before, "down", "one", "--system", "two")
    assert found.exit_code == 2
    assert found.stderr == "regraft: SYSTEM is 'one', but --system is 'two': omit one\n"
