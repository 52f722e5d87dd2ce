"""The ends of components' logs."""

from __future__ import annotations

from pathlib import Path

from bus_schema import codec
from bus_schema.keys import component_name
from bus_schema.messages.host import LogLines, LogRequest

MOST_BYTES = 1024 * 1024


def tail(folder: Path, payload: bytes) -> LogLines:
    """Return the last lines of a component's log; an absent log has none. Raises BadMessage, BadKey."""
    asked = codec.decode(payload, LogRequest)
    path = folder / f"{component_name(asked.component)}.log"
    try:
        with path.open("rb") as log:
            log.seek(max(0, path.stat().st_size - MOST_BYTES))
            lines = log.read().decode(errors="replace").splitlines()
    except OSError:
        lines = []
    return LogLines(asked.component, tuple(line[:2000] for line in lines[-asked.lines :]))
