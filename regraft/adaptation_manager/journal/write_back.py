"""Moves what was written ahead into the journal's file, on a thread of its own: to wait for a disk can take seconds."""

from __future__ import annotations

import contextlib
import logging
import sqlite3
import threading
from pathlib import Path

WRITE_BACK_TIMEOUT = 250
"""Transactions after which what was written ahead is long enough to be moved: a few megabytes."""
TOO_LONG = 4096
"""Pages written ahead, of 4 KiB, from which on a commit itself moves them, which bounds the file."""
KEEP = 4 * 1024 * 1024
"""Bytes to which the write-ahead file is cut when it begins again."""
PASSES = 20
"""How often it is tried to move all there is before the next transaction comes."""


class WriteBack:
    """Comes before SQLite's automatic checkpoints, which make a commit wait for the disk.

    Readers and writers continue meanwhile (https://sqlite.org/wal.html, passive checkpoints). Only the first
    transaction after it waits until one page is on the disk: it restarts the write-ahead file.
    """

    def __init__(self, path: str) -> None:
        """Care for the SQLite file at ``path``; empty for one in memory, which needs none of this."""
        self._path = path
        self._ahead = 0
        self._thread: threading.Thread | None = None

    @staticmethod
    def prepare(database: sqlite3.Connection) -> None:
        """Let a connection leave to this what it would do itself at once."""
        database.execute(f"PRAGMA wal_autocheckpoint = {TOO_LONG}")
        database.execute(f"PRAGMA journal_size_limit = {KEEP}")

    def committed(self) -> None:
        """Count a transaction."""
        self._ahead += 1

    def if_due(self) -> None:
        """Begin, if enough was written ahead and the last time has ended; returns at once."""
        busy = self._thread is not None and self._thread.is_alive()
        if self._path and self._ahead >= WRITE_BACK_TIMEOUT and not busy:
            self._ahead = 0
            self._thread = threading.Thread(target=self._write_back, name="journal-write-back", daemon=True)
            self._thread.start()

    def _write_back(self) -> None:
        try:
            existing = f"{Path(self._path).absolute().as_uri()}?mode=rw"
            with contextlib.closing(sqlite3.connect(existing, uri=True)) as database:
                moved = -1
                for _ in range(PASSES):
                    before = moved
                    _, _, moved = database.execute("PRAGMA wal_checkpoint(PASSIVE)").fetchone()
                    if moved == before:  # nobody has written meanwhile: the next transaction begins the file again
                        return
        except sqlite3.Error as error:  # nothing is lost: it is read from where it was written ahead
            logging.getLogger("journal").warning("the journal %s cannot be written back: %s", self._path, error)
