"""Texts that come from anywhere, made fit for messages."""

from __future__ import annotations


def encodable(text: object) -> str:
    r"""Return a text as messages can carry it: a lone surrogate, which no encoding has, becomes its escape.

    >>> encodable("no file caf\udce9")
    'no file caf\\udce9'
    """
    return str(text).encode(errors="backslashreplace").decode()
