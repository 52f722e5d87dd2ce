"""Every number that a command takes has bounds, and one beyond them is told with both."""

from __future__ import annotations

from typing import Any

import pytest
import typer

from tests.cli.app import whole
from tests.cli.conftest import Regraft
from tests.cli.test_mistakes import commands

OPTIONS = [
    ("up", "STACK", "--for"),
    ("up", "STACK", "--seed"),
    ("topic", "echo", "scan", "--count"),
    ("topic", "hz", "scan", "--for"),
    ("events", "--count"),
    ("events", "--for"),
    ("logs", "a", "--lines"),
    ("service", "call", "a", "--timeout"),
    ("action", "send", "a", "--timeout"),
    ("adapt", "-", "--timeout"),
    ("adapt", "-", "--confirm"),
    ("adapt", "-", "--if-revision"),
    ("planner", "propose", "a", "-", "--timeout"),
    ("journal", "--limit"),
    ("journal", "diff", "1"),
    ("evaluate", "study", "--runs"),
    ("evaluate", "study", "--for"),
    ("evaluate", "study", "--parallel"),
    ("evaluate", "study", "--seed"),
]


@pytest.mark.parametrize("number", ["9" * 400, "9" * 5000, "1e400", "inf"], ids=["400", "5000", "1e400", "inf"])
@pytest.mark.parametrize("command", OPTIONS, ids=" ".join)
def test_a_number_that_is_too_large_is_told_with_the_bounds(
    regraft: Regraft, command: tuple[str, ...], number: str
) -> None:
    found = regraft(*command, number)
    assert found.exit_code == 2
    assert "too large: must be from" in " ".join(found.stderr.split())
    assert len(found.stderr) < 600


@pytest.mark.parametrize("number", ["fast", "nan", "", "true"])
def test_what_is_no_number_is_told_as_that(regraft: Regraft, number: str) -> None:
    for command in OPTIONS:
        found = regraft(*command, number)
        assert (found.exit_code, "must be a" in " ".join(found.stderr.split())) == (2, True), (command, found.stderr)


def test_no_number_goes_without_bounds() -> None:
    app = typer.main.get_command(whole())
    unbounded = [(names, number) for names, _ in commands(app) for number in _unbounded(app, names)]
    assert unbounded == []


def _unbounded(command: Any, names: tuple[str, ...]) -> list[str]:
    """Return the parameters of a command that are numbers and have no parser of ours."""
    for name in names:
        command = command.commands[name]
    kinds = {each.name: each.type_descriptor for each in command.params if hasattr(each, "type_descriptor")}
    assert kinds or not command.params
    return [name for name, kind in kinds.items() if kind.annotation in (int, float) and not kind.parameter_info.parser]


@pytest.mark.parametrize("duration", ["9" * 400 + "d", "9" * 5000 + "s", "9" * 30 + "h"])
def test_a_token_is_not_valid_for_ever(regraft: Regraft, duration: str) -> None:
    found = regraft("token", "create", "--role", "operate", "--for", duration, "--system", "robot")
    assert found.exit_code == 2
    assert "366" in found.stderr
