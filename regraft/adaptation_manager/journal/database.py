"""The journal's database: an SQLite file that is opened, written in transactions, kept in its place, and sifted."""

from __future__ import annotations

import contextlib
import os
import sqlite3
from collections.abc import Callable, Iterator
from pathlib import Path

from regraft.adaptation_manager.journal.damage import Damaged, damaged_rows, set_rows_aside
from regraft.adaptation_manager.journal.schema import LATER_TABLES, SCHEMA, VERSION
from regraft.adaptation_manager.journal.seals import seal
from regraft.adaptation_manager.journal.write_back import WriteBack

SIDES = ("", "-wal", "-shm")
"""The endings of the names of the file and of its side files."""

LOCKED_TIMEOUT = 0.3
"""Seconds for which a lock of another process is waited for: the manager is silent meanwhile."""
MAX_TOLD = 10
"""Damaged rows that are named; of more, only the number is reported."""


class JournalError(Exception):
    """The journal cannot be written or read now: full disk, no right, locked; the text states which."""


class JournalCorrupt(JournalError):
    """The file is no journal, or a damaged one."""


class JournalDatabase:
    """An open journal; ``tell`` is called with rows that were set aside."""

    def __init__(self, path: str, tell: Callable[[str], object]) -> None:
        """Open ``path``, new if need be; empty for one in memory. Raises JournalError, JournalCorrupt."""
        self.path = path
        self._tell = tell
        self._open()

    def _open(self) -> None:
        self.write_back = WriteBack(self.path)
        with self.told("cannot be opened"):
            if self.path:
                Path(self.path).parent.mkdir(parents=True, exist_ok=True)
            # To open a long one takes a while, so another thread than the manager's does that.
            self.database = sqlite3.connect(
                self.path or ":memory:", LOCKED_TIMEOUT, isolation_level=None, check_same_thread=False
            )
        try:
            with self.told("cannot be opened"):
                self._prepare()
        except JournalError:
            self.close()
            raise

    def _prepare(self) -> None:
        self.database.execute("PRAGMA journal_mode = WAL")
        self.database.execute("PRAGMA synchronous = NORMAL")
        self.write_back.prepare(self.database)
        (version,) = self.database.execute("PRAGMA user_version").fetchone()
        if version == 0:
            term = f"INSERT INTO term VALUES (0, x'{seal(0).hex()}');"
            self.database.executescript(f"BEGIN;{SCHEMA}{term}PRAGMA user_version = {VERSION};COMMIT;")
        elif version != VERSION:
            raise JournalCorrupt(f"the journal {self.path} has version {version}, must be {VERSION}")
        self.database.executescript(LATER_TABLES)
        (verdict,) = self.database.execute("PRAGMA quick_check(1)").fetchone()
        if verdict != "ok":
            raise JournalCorrupt(f"the journal {self.path} is damaged: {verdict}")
        self._files = self._found()

    @contextlib.contextmanager
    def told(self, what: str) -> Iterator[None]:
        """Turn SQLite's and the system's errors into ours."""
        try:
            yield
        except (sqlite3.OperationalError, OSError) as error:
            raise JournalError(f"the journal {self.path or 'in memory'} {what}: {error}") from None
        except (sqlite3.DatabaseError, ValueError) as error:
            raise JournalCorrupt(f"the journal {self.path or 'in memory'} {what}: {error}") from None

    @contextlib.contextmanager
    def transaction(self) -> Iterator[sqlite3.Connection]:
        """Return the database to write to: all of it is written in the end, or nothing. Raises JournalError."""
        with self.told("cannot be written"):
            self.database.execute("BEGIN IMMEDIATE")
            try:
                yield self.database
                self.database.execute("COMMIT")
                self.write_back.committed()
            except BaseException:
                if self.database.in_transaction:
                    self.database.execute("ROLLBACK")
                raise

    def sift(self, run: str) -> list[Damaged]:
        """Set the rows of a run aside that are not as they were written; returns them. Raises JournalError."""
        with self.told("cannot be read"):
            damaged = damaged_rows(self.database, run)
        if damaged:
            with self.transaction() as database:
                set_rows_aside(database, damaged)
            named = ", ".join(map(str, damaged[:MAX_TOLD])) + (" and more" if len(damaged) > MAX_TOLD else "")
            self._tell(
                f"rows of the journal {self.path} are not as they were written, and were set aside in its table "
                f"'damaged', {len(damaged)} in all: {named}"
            )
        return damaged

    # --- its place ---

    def is_in_place(self) -> bool:
        """Return whether what is open is what others find at its path."""
        return not self.path or self._found() == self._files

    def _found(self) -> list[tuple[int, int] | None]:
        return [_identity(self.path + side) for side in SIDES[:2]]

    def write_anew(self) -> str:
        """Write all that is open to its place again; returns where a file that was there is now, or nothing.

        Raises:
            JournalError: it cannot be written there; what is open stays open.
        """
        anew = f"{self.path}.anew"
        with self.told("cannot be written anew"):
            Path(self.path).parent.mkdir(parents=True, exist_ok=True)
            Path(anew).unlink(missing_ok=True)
            with contextlib.closing(sqlite3.connect(anew)) as copy:
                self.database.backup(copy)
            other = set_aside(self.path, "replaced") if os.path.exists(self.path) else ""
            self.close()  # removes the side files of its name
            os.replace(anew, self.path)
        self._open()
        return other

    def close(self) -> None:
        """Close the file."""
        with contextlib.suppress(sqlite3.Error):
            self.database.close()


def _identity(path: str) -> tuple[int, int] | None:
    try:
        found = os.stat(path)
    except OSError:
        return None
    return found.st_dev, found.st_ino


def set_aside(path: str, why: str = "corrupt") -> str:
    """Rename a journal that is not to be used, and its side files; returns the new path. Raises JournalError."""
    number = 1
    while Path(aside := f"{path}.{why}-{number}").exists():
        number += 1
    try:
        for side in SIDES:
            if Path(path + side).exists():
                Path(path + side).rename(aside + side)
    except OSError as error:
        raise JournalError(f"the journal {path} cannot be set aside: {error}") from None
    return aside
