"""SUAVE's stack, run as a user runs it, and what was decided in it."""

from __future__ import annotations

import json
import os
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.model.adaptation import AdaptationReport, EnterMode
from tests.suave.deciding import SUAVE
from tests.support.commands import run


def ran(home: Path, seconds: float, *settings: str) -> dict[str, Any]:
    """Run it for so many simulated seconds with some settings, and return what it reports in the end."""
    options = [word for setting in settings for word in ("--set", setting)]
    words = ("up", str(SUAVE), "--for", f"{seconds:g}", "--json", "--headless", *options)
    ended = run(*words, environment={**os.environ, "REGRAFT_HOME": str(home)}, within=1800.0)
    assert ended.returncode == 0, ended.stderr
    summary: dict[str, Any] = json.loads(ended.stdout)
    return summary


def entered(home: Path) -> list[str]:
    """Return the modes that the metacontroller has entered, in their order."""
    with closing(sqlite3.connect(home / "suave" / "journal.sqlite")) as journal:
        rows = journal.execute("SELECT report FROM adaptations WHERE actor = 'metacontrol' ORDER BY number").fetchall()
    reports = [codec.decode(row[0], AdaptationReport) for row in rows]
    return [change.mode for each in reports for change in each.request.changes if isinstance(change, EnterMode)]
