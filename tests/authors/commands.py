"""Runs ``regraft mission`` in this process."""

from __future__ import annotations

from typer.testing import CliRunner, Result

from tests.cli.app import whole


def mission(*arguments: object, text: str | None = None) -> Result:
    """Return what ``regraft mission ARGUMENTS`` gave."""
    return CliRunner().invoke(whole(), ["mission", *map(str, arguments)], input=text)


def refused(*arguments: object) -> str:
    """Run a command that must be refused as bad input, and return what it complained about."""
    done = mission(*arguments)
    assert (done.exit_code, done.stdout) == (2, ""), done
    assert done.exception is None or isinstance(done.exception, SystemExit)
    return done.stderr
