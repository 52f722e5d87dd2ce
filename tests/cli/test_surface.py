"""The commands, arguments and options stand in a file: whoever changes them changes it too, knowingly."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer

from regraft.cli.main import build
from tests.cli.conftest import Regraft

SURFACE = Path(__file__).parent / "surface.txt"


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
    found = list(surface(typer.main.get_command(build()), "regraft"))
    assert found == SURFACE.read_text().splitlines()


@pytest.mark.parametrize("line", SURFACE.read_text().splitlines())
def test_every_command_has_help(regraft: Regraft, line: str) -> None:
    words = [word for word in line.split()[1:] if word.islower() and not word.startswith("-")]
    assert regraft(*words, "--help").exit_code == 0


def test_help_lists_the_exit_codes(regraft: Regraft) -> None:
    shown = regraft("--help").output
    for code in ("0", "1", "2", "3", "130"):
        assert f"\n    {code} " in shown or f"\n  {code} " in shown
