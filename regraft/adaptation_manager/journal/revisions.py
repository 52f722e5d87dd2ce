"""The architectures of a run, by revision: the journal's lines are changes, applied one after the other.

Every so many revisions the architecture is kept whole, and lines are applied from there on. To find one revision takes
as long after a year as after an hour.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from regraft.adaptation_manager.journal.rows import decoded
from regraft.adaptation_manager.journal.schema import FOLLOWING, KEPT, LINE, RUN
from regraft.adaptation_manager.journal.seals import Field, is_sealed, seal
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.protocol.host import UpdateSpecs
from regraft.bus_schema.model.adaptation import AdaptationReport
from regraft.bus_schema.model.architecture import Architecture

if TYPE_CHECKING:
    from regraft.adaptation_manager.journal.journal import Journal

KEEP_EVERY = 100
"""Revisions after which an architecture is kept whole: to apply so many lines takes some 10 ms."""
NEWEST = 2**62
"""Above every revision; SQLite knows no numbers from twice as many on."""


def architecture_at(journal: Journal, revision: int | None = None) -> Architecture | None:
    """Return the architecture at a revision of the journal's run (None: the newest). Raises JournalError.

    None if there is none, or if a line that leads to it is damaged.
    """
    if revision is not None and revision > NEWEST:
        return None
    newest, wanted = None, NEWEST if revision is None else revision
    for reached in _replay(journal, wanted, wanted):
        if reached is None or reached.revision == revision:
            return reached
        newest = reached
    return newest if revision is None else None


def architectures_around(journal: Journal, report: AdaptationReport) -> tuple[Architecture | None, Architecture | None]:
    """Return the architectures before and behind an adaptation, each as `architecture_at` does. Raises JournalError."""
    before = behind = None
    for reached in _replay(journal, report.revision_before, report.revision_after):
        if reached is None:
            break
        if reached.revision == report.revision_before:
            before = reached
        if reached.revision == report.revision_after:
            behind = reached
    return before, behind


def keep_if_due(journal: Journal, architecture: Architecture) -> None:
    """Keep an architecture of which all lines are written, if the last one kept is long ago. Raises JournalError."""
    with journal.told("cannot be read"):
        ((last,),) = journal.database.execute(
            "SELECT coalesce(max(revision), 0) FROM architectures WHERE run = ?", (journal.run,)
        ).fetchall()
    if isinstance(last, int) and architecture.revision - last >= KEEP_EVERY:
        row: tuple[Field, ...] = (journal.run, architecture.revision, codec.encode(architecture))
        with journal.transaction() as database:
            database.execute("INSERT OR REPLACE INTO architectures VALUES (?, ?, ?, ?)", (*row, seal(*row)))


def _replay(journal: Journal, first: int, last: int) -> Iterator[Architecture | None]:
    """Yield architectures up to revision ``last``, from the last whole one on that is not after ``first``.

    It ends with None if there is none, or where a line is damaged.
    """
    with journal.told("cannot be read"):
        architecture = _whole(journal, first)
        yield architecture
        if architecture is None:
            return
        lines = journal.database.execute(
            f"SELECT {LINE}, seal, {FOLLOWING}, following_seal FROM adaptations "
            "WHERE run = ? AND revision > ? AND revision <= ? ORDER BY revision",
            (journal.run, architecture.revision, last),
        ).fetchall()
        for row in lines:
            architecture = _followed(architecture, row)
            yield architecture
            if architecture is None:
                return


def _whole(journal: Journal, first: int) -> Architecture | None:
    """Return the last whole architecture that is not after a revision: one that was kept, else the run's start."""
    start = journal.database.execute(f"SELECT {RUN}, seal FROM runs WHERE run = ?", (journal.run,)).fetchone()
    if start is None or not is_sealed(start):
        return None
    begun = decoded(start[1], Architecture)
    # Architectures kept before a run began again do not lead to what holds now.
    kept = journal.database.execute(
        f"SELECT {KEPT}, seal FROM architectures WHERE run = ? AND revision > ? AND revision <= ? "
        "ORDER BY revision DESC",
        (journal.run, begun.revision, first),
    )
    whole = next((row for row in kept if is_sealed(row)), None)
    return _as_replayed(decoded(whole[2], Architecture), begun) if whole is not None else begun


def _as_replayed(kept: Architecture, begun: Architecture) -> Architecture:
    """Return a kept architecture with only that taken from it which lines change; hosts may have joined meanwhile."""
    return replace(
        begun,
        components=kept.components,
        topics=kept.topics,
        asked_modes=kept.asked_modes,
        revision=kept.revision,
    )


def _followed(architecture: Architecture, row: tuple[Any, ...]) -> Architecture | None:
    """Return what a line makes of an architecture; None if it is damaged, or one before it is missing."""
    line, following = row[:9], row[9:]
    # A line is read as plain data: to make a report of each took most of the time of a long replay.
    intact = is_sealed(line) and is_sealed(following)
    if not intact or codec.unpack_plain(line[7])["revision_before"] != architecture.revision:
        return None
    return decoded(following[2], UpdateSpecs).applied_to(architecture)
