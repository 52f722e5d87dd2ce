"""A stack, run as a user runs it, and what was decided in it."""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.model.adaptation import AdaptationReport, EnterMode
from tests.support.commands import in_home, run


def ran(stack: Path, home: Path, seconds: float, *settings: str) -> dict[str, Any]:
    """Run a stack for so many simulated seconds with some settings, and return what it reports in the end.

    The run has to be repeatable and without problems.
    """
    options = [word for setting in settings for word in ("--set", setting)]
    words = ("up", str(stack), "--speed", "max", "--for", f"{seconds:g}", "--json", "--headless", *options)
    ended = run(*words, environment=in_home(home), within=1800.0)
    assert ended.returncode == 0, ended.stderr
    summary: dict[str, Any] = json.loads(ended.stdout)
    assert (summary["reproducible"], summary["problems"]) == (True, [])
    return summary


def reports(home: Path) -> list[AdaptationReport]:
    """Return the adaptations of the one system that ran in a home, in their order."""
    (file,) = home.glob("*/journal.sqlite")
    with closing(sqlite3.connect(file)) as journal:
        rows = journal.execute("SELECT report FROM adaptations ORDER BY number").fetchall()
    return [codec.decode(row[0], AdaptationReport) for row in rows]


def entered(home: Path, actor: str = "metacontrol") -> list[tuple[float, str]]:
    """Return the modes that a manager has entered and when (s), in their order; rest is empty."""
    return [
        (report.started, change.mode)
        for report in reports(home)
        for change in report.request.changes
        if isinstance(change, EnterMode) and report.request.actor == actor
    ]


def modes(home: Path, actor: str = "metacontrol") -> list[str]:
    """Return the modes that a manager has entered, in their order."""
    return [mode for _, mode in entered(home, actor)]
