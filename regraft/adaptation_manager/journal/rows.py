"""Reads what the journal's rows hold."""

from __future__ import annotations

from typing import TypeVar

from regraft.adaptation_manager.journal.database import JournalCorrupt
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage

M = TypeVar("M")


def decoded(raw: bytes, cls: type[M]) -> M:
    """Return what a row holds; raises JournalCorrupt if another version of Regraft has written it."""
    try:
        return codec.decode(raw, cls)
    except BadMessage as error:
        raise JournalCorrupt(f"the journal holds what cannot be read: {error}") from None
