"""Components' logs: their ends, and their bound. A log that is too long is kept as ``.1``, and begins again."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.keys import component_name
from regraft.bus_schema.messages.protocol.host import LogLines, LogRequest

HOST_LOG = "host.log"
"""The log of a host itself, next to those of its components."""
MAX_BYTES = 1024 * 1024
MAX_LOG_SIZE = 8 * 1024 * 1024
"""Bytes to which a log may grow, and that are kept of it when it begins again."""


def tail(folder: Path, payload: bytes) -> LogLines:
    """Return the last lines of a component's log; an absent log has none. Raises BadMessage, BadKey."""
    asked = codec.decode(payload, LogRequest)
    path = log_of(folder, component_name(asked.component))
    try:
        with path.open("rb") as log:
            log.seek(max(0, path.stat().st_size - MAX_BYTES))
            lines = log.read().decode(errors="replace").splitlines()
    except OSError:
        lines = []
    return LogLines(asked.component, tuple(line[:2000] for line in lines[-asked.lines :]))


def log_of(folder: Path, component: str) -> Path:
    """Return where a component's log is in the folder of logs."""
    return folder / f"{component}.log"


def begin_anew_if_long(log: Path) -> None:
    """Keep the end of a log that has grown too long as ``.1``, and empty it; its writers continue.

    It is copied, since programs hold it open. Readers find the previous end until the copy is complete. A failed
    attempt is repeated the next time.
    """
    kept, copy = f"{log}.1", f"{log}.1.part"
    try:
        if log.stat().st_size <= MAX_LOG_SIZE:
            return
        with log.open("r+b") as long:
            with open(copy, "wb", opener=_private) as end:
                long.seek(-MAX_LOG_SIZE, os.SEEK_END)
                for _ in range(2 * MAX_LOG_SIZE // MAX_BYTES):  # somebody may write as fast as this reads
                    part = long.read(MAX_BYTES)
                    if not part:
                        break
                    end.write(part)
            os.replace(copy, kept)
            long.truncate(0)
    except OSError:
        with contextlib.suppress(OSError):
            os.unlink(copy)


def _private(path: str, flags: int) -> int:
    return os.open(path, flags, 0o600)
