"""The patrol's stack, run as a user runs it, and what was decided in it."""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.model.adaptation import AdaptationReport, EnterMode
from tests.support.commands import in_home, run
from tests.support.paths import PATROL


def ran(home: Path, seconds: float, *settings: str, stack: Path = PATROL) -> dict[str, Any]:
    """Run it for so many simulated seconds with some settings, and return what it reports in the end."""
    options = [word for setting in settings for word in ("--set", setting)]
    words = ("up", str(stack), "--speed", "max", "--for", f"{seconds:g}", "--json", "--headless", *options)
    ended = run(*words, environment=in_home(home), within=1800.0)
    assert ended.returncode == 0, ended.stderr
    summary: dict[str, Any] = json.loads(ended.stdout)
    assert (summary["reproducible"], summary["problems"]) == (True, [])
    return summary


def entered(home: Path, actor: str = "metacontrol") -> list[tuple[float, str]]:
    """Return the modes that a manager has entered and when (s), in their order; rest is empty."""
    with closing(sqlite3.connect(home / "patrol" / "journal.sqlite")) as journal:
        rows = journal.execute("SELECT report FROM adaptations WHERE actor = ? ORDER BY number", (actor,)).fetchall()
    reports = [codec.decode(row[0], AdaptationReport) for row in rows]
    return [
        (report.started, change.mode)
        for report in reports
        for change in report.request.changes
        if isinstance(change, EnterMode)
    ]
