"""The envelope of a sample: who sent it, and its place in its output's numbering. It travels as the attachment.

Layout, little-endian: version (u8), kind (u8), reserved (u16), epoch (u32), incarnation (u32). Then sequence (u64),
stamp (i64, nanoseconds), and the source's name in UTF-8.
"""

from __future__ import annotations

import struct
from enum import IntEnum
from typing import NamedTuple

from regraft.bus_schema.errors import BadMessage

VERSION = 2
LAYOUT = struct.Struct("<BBHIIQq")
PLACE = struct.Struct("<Qq")
"""The part of the layout that differs from sample to sample: sequence and stamp; the run's part comes before it."""
RUN_ENDS, PLACE_ENDS = LAYOUT.size - PLACE.size, LAYOUT.size
"""The other parts are the same in all data samples of one run of one source, and in no others."""
MAX_INCARNATION = 2**32 - 1
MAX_SOURCE_LENGTH = 160
"""Bytes of a source's name: the longest component name is 129, the longest client name 160."""


class Kind(IntEnum):
    """The kind of a sample: data, or a marker that only states how far the numbering has come."""

    DATA = 0
    MARKER = 1


KINDS = tuple(Kind)


class Envelope(NamedTuple):
    """Source, epoch (the incarnation that began the numbering), incarnation, sequence, and stamp in nanoseconds.

    A marker's sequence is that of the last data sample before it, 0 if there was none.
    One is made per sample received: a named tuple is made in half the time of a frozen dataclass, and in half of
    that by ``tuple.__new__``.
    """

    source: str
    epoch: int
    incarnation: int
    sequence: int
    stamp: int
    kind: Kind = Kind.DATA

    def to_bytes(self) -> bytes:
        """Return the attachment; raises BadMessage if a number or the name does not fit the layout."""
        try:
            source = self.source.encode()
            head = LAYOUT.pack(VERSION, self.kind, 0, self.epoch, self.incarnation, self.sequence, self.stamp)
        except (struct.error, UnicodeEncodeError) as error:
            raise BadMessage(f"does not fit an envelope: {error}") from None
        if not 0 < len(source) <= MAX_SOURCE_LENGTH:
            raise BadMessage(f"has a source of {len(source)} bytes, must be 1 to {MAX_SOURCE_LENGTH}")
        return head + source

    @classmethod
    def from_bytes(cls, attachment: bytes) -> Envelope:
        """Return the envelope in ``attachment``; raises BadMessage if it is none."""
        if len(attachment) <= LAYOUT.size or len(attachment) > LAYOUT.size + MAX_SOURCE_LENGTH:
            raise BadMessage(f"has an attachment of {len(attachment)} bytes, not an envelope")
        version, kind, _, epoch, incarnation, sequence, stamp = LAYOUT.unpack_from(attachment)
        if version != VERSION:
            raise BadMessage(f"has an envelope of version {version}, must be {VERSION}")
        if kind >= len(KINDS):
            raise BadMessage(f"has an envelope of the unknown kind {kind}")
        try:
            source = attachment[LAYOUT.size :].decode()
        except UnicodeDecodeError:
            raise BadMessage("has an envelope whose source is not UTF-8") from None
        return tuple.__new__(cls, (source, epoch, incarnation, sequence, stamp, KINDS[kind]))


def run_part(kind: Kind, epoch: int, incarnation: int) -> bytes:
    """Return the part of the layout that stays the same for a run: what comes before sequence and stamp."""
    return LAYOUT.pack(VERSION, kind, 0, epoch, incarnation, 0, 0)[:RUN_ENDS]


def is_marker(attachment: bytes) -> bool:
    """Return whether an attachment is a marker's envelope, without opening it."""
    return len(attachment) > LAYOUT.size and attachment[1] == Kind.MARKER
