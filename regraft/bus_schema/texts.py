"""Texts that come from anywhere, made fit for messages."""

from __future__ import annotations


def encodable(text: object) -> str:
    r"""Return a text as messages can carry it: a lone surrogate, which no encoding has, becomes its escape.

    >>> encodable("no file caf\udce9")
    'no file caf\\udce9'
    """
    return str(text).encode(errors="backslashreplace").decode()


def text_of(error: BaseException) -> str:
    """Return an exception's text as messages can carry it; empty if asking for it fails, for an author writes that."""
    try:
        return encodable(error)
    except Exception:
        return ""


def told(error: BaseException) -> str:
    """Return an exception's type and text as messages can carry them, such as ``ValueError: too fast``."""
    text, kind = text_of(error), encodable(type(error).__name__)
    return f"{kind}: {text}" if text else kind
