"""Finds out how the bytes of an XML document encode its characters (XML 1.0, appendix F)."""

import codecs
import re
from typing import Final

_MARKS: Final = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)
_BEGINNINGS: Final = {b"<\0?\0": "utf-16-le", b"\0<\0?": "utf-16-be"}
_DECLARED: Final = re.compile(rb"""\s*<\?xml\s[^>]{0,200}?encoding\s?=\s?["']([A-Za-z0-9._:-]{1,40})["']""")
_ONE_BYTE: Final = re.compile(r"utf-8|ascii|iso8859-\d+|cp125\d")
_HEAD: Final = 400


def decode(data: bytes) -> str:
    """Return a document's text: by its byte order mark, by its declaration, else as UTF-8.

    Raises:
        ValueError: The encoding is unknown, or the bytes are not of it.
    """
    for mark, encoding in _MARKS:
        if data.startswith(mark):
            return data[len(mark) :].decode(encoding)
    return data.decode(_BEGINNINGS.get(data[:4]) or _declared(data[:_HEAD]))


def _declared(head: bytes) -> str:
    found = _DECLARED.match(head)
    if found is None:
        return "utf-8"
    name = found.group(1).decode("ascii")
    try:
        encoding = codecs.lookup(name).name
    except LookupError:
        encoding = ""
    if encoding.startswith("utf-16"):
        return "utf-8"  # A declaration that can be read byte by byte is not in UTF-16: an editor left it there.
    if not _ONE_BYTE.fullmatch(encoding):
        raise ValueError(f"encoding '{name}' is not known: must be UTF-8, UTF-16, US-ASCII, ISO-8859 or Windows-125x")
    return encoding
