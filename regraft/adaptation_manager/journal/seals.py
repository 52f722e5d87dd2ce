"""Seals on the journal's rows: what has changed since it was written is noticed when it is read."""

from __future__ import annotations

import hashlib

SEAL_BYTES = 8

Field = str | bytes | int | None


def seal(*fields: Field) -> bytes:
    """Return a checksum over a row's fields, in their order; it does not protect against a program that computes one,
    too.
    """
    parts: list[bytes] = []
    for field in fields:
        raw = field if isinstance(field, bytes) else repr(field).encode()
        parts += (f"{type(field).__name__} {len(raw)} ".encode(), raw)
    return hashlib.blake2b(b"".join(parts), digest_size=SEAL_BYTES).digest()


def is_sealed(row: tuple[Field, ...]) -> bool:
    """Return whether a row, whose last field is its seal, is as it was written."""
    return seal(*row[:-1]) == row[-1]
