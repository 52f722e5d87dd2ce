"""The journal's lines of components that failed, died or recovered: what adaptations may have been made for."""

from __future__ import annotations

from collections.abc import Iterable

from regraft.adaptation_manager.journal.journal import Journal, JournalError
from regraft.adaptation_manager.journal.seals import is_sealed, seal
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.management.system import SystemFault, SystemFaultKind

MAX_READ = 500
MAX_WAITING = 1000
"""Lines that wait while the journal cannot be written; of more, the oldest are left out."""


class FaultLines:
    """Writes and reads the lines; each fault has one, however often it is reported."""

    def __init__(self) -> None:
        self._waiting: list[SystemFault] = []

    def note(self, faults: Iterable[SystemFault], journal: Journal | None) -> None:
        """Write the lines of faults that are not over at once; without a journal they wait for the next."""
        lasting = tuple(fault for fault in faults if fault.kind is not SystemFaultKind.RAISED)
        self._waiting = [*self._waiting, *lasting][-MAX_WAITING:]
        if journal is not None and journal.run and self._waiting:
            self._write(journal)

    def _write(self, journal: Journal) -> None:
        rows = [(journal.run, fault.stamp, payload, seal(journal.run, payload)) for fault, payload in self._encoded()]
        try:
            with journal.transaction() as database:
                database.executemany("INSERT OR IGNORE INTO faults VALUES (?, ?, ?, ?)", rows)
        except JournalError:
            return  # they wait for the next
        self._waiting = []

    def _encoded(self) -> list[tuple[SystemFault, bytes]]:
        return [(fault, codec.encode(fault)) for fault in self._waiting]

    def read(self, journal: Journal, since: float, until: float) -> tuple[SystemFault, ...]:
        """Return the faults from ``since`` up to ``until``, newest first; raises JournalError."""
        self.note((), journal)
        with journal.told("cannot be read"):
            rows = journal.database.execute(
                "SELECT run, fault, seal FROM faults WHERE run = ? AND stamp >= ? AND stamp < ? "
                "ORDER BY stamp DESC, rowid DESC LIMIT ?",
                (journal.run, since, until, MAX_READ),
            ).fetchall()
        return tuple(codec.decode(row[1], SystemFault) for row in rows if is_sealed(row))
