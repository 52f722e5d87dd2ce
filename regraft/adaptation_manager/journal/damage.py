"""Finds the rows of a journal that are not as they were written, and sets them aside: the rest continues."""

from __future__ import annotations

import sqlite3
from dataclasses import dataclass

from regraft.adaptation_manager.journal.schema import CREATE_INDEXES, DROP_INDEXES, FOLLOWING, LINE, PLAN, RUN, STATE
from regraft.adaptation_manager.journal.seals import is_sealed

SEALED = {
    "runs": (("seal", RUN),),
    "adaptations": (("seal", LINE), ("following_seal", FOLLOWING)),
    "steps": (("seal", STATE), ("plan_seal", PLAN)),
}
"""By table: its seals, each with the fields that it is over; these begin with the row's place."""

PLACE = ("run", "number", "step")
PLACES = {"runs": 1, "adaptations": 2, "steps": 3}
"""By table: how many fields make a row's place."""

MAX_FIELDS_KEPT = 100_000
"""Characters that are kept of a damaged row, for a person to look at."""


@dataclass(frozen=True, slots=True)
class Damaged:
    """A row that was set aside: its table, and its place there."""

    table: str
    place: tuple[object, ...]

    def __str__(self) -> str:
        """Report which row it was."""
        what = {"runs": "the run's start", "adaptations": "adaptation", "steps": "a step of adaptation"}[self.table]
        return f"{what} {self.place[1]}" if len(self.place) > 1 else what


def damaged_rows(database: sqlite3.Connection, run: str) -> list[Damaged]:
    """Return the rows of a run that are not as they were written. Raises sqlite3.Error."""
    found = {
        Damaged(table, row[:places]): None
        for table, places in PLACES.items()
        for name, fields in SEALED[table]
        for row in database.execute(f"SELECT {fields}, {name} FROM {table} NOT INDEXED WHERE run = ?", (run,))
        if not is_sealed(row)
    }
    return list(found)


def set_rows_aside(database: sqlite3.Connection, damaged: list[Damaged]) -> None:
    """Move rows to the table of those that are damaged, within the transaction that is open. Raises sqlite3.Error.

    The indexes are rebuilt: they may hold values that the rows no longer have.
    """
    for statement in DROP_INDEXES:
        database.execute(statement)
    for row in damaged:
        here = " AND ".join(f"{field} = ?" for field in PLACE[: len(row.place)])
        fields = repr(database.execute(f"SELECT * FROM {row.table} WHERE {here}", row.place).fetchone())
        place = (row.table, row.place[0], row.place[1] if len(row.place) > 1 else None, fields[:MAX_FIELDS_KEPT])
        database.execute("INSERT INTO damaged VALUES (?, ?, ?, ?)", place)
        database.execute(f"DELETE FROM {row.table} WHERE {here}", row.place)
    for statement in CREATE_INDEXES:
        database.execute(statement)
