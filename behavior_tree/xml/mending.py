"""Mends what is no XML but read by BehaviorTree.CPP's parser all the same.

Comments end at the first ``-->``, with any content. In attributes and in text, ``&`` and ``<`` may mean
themselves, as in ``_skipIf="a < 2 && b"``. Blanks may come before the XML declaration, and anything behind the root.
"""

import re
from typing import Final

# Possessive, so that a document that is hopeless is found so in one pass.
_TAG: Final = re.compile(r"""<[^\s<>"'!?][^<>"']*+(?:"[^"]*+"[^<>"']*+|'[^']*+'[^<>"']*+)*+>""")
_LOOSE_AMPERSAND: Final = re.compile(r"&(?!#\d+;|#x[0-9a-fA-F]+;|(?:amp|lt|gt|quot|apos);)")
_END: Final = re.compile(r"</root\s*+>")
_VERBATIM: Final = {"<![CDATA[": "]]>", "<?": "?>"}
_COMMENT: Final = ("<!--", "-->")


def mended(text: str) -> str:
    """Return a document as XML proper, as far as it can be mended; lines keep their numbers."""
    text = _without_blanks_before_declaration(text)
    parts: list[str] = []
    position = 0
    while True:
        start = text.find("<", position)
        if start < 0:
            return "".join([*parts, _escaped(text[position:])])
        parts.append(_escaped(text[position:start]))
        part, position = _markup(text, start)
        parts.append(part)
        if position == len(text) or _END.fullmatch(part):
            return "".join(parts)


def _markup(text: str, start: int) -> tuple[str, int]:
    """Return what begins with ``<`` in a form that is XML, and where it ends."""
    begin, end = _COMMENT
    if text.startswith(begin, start):
        stop = _behind(text, end, start + len(begin))
        return "\n" * text.count("\n", start, stop), stop
    for begin, end in _VERBATIM.items():
        if text.startswith(begin, start):
            stop = _behind(text, end, start)
            return text[start:stop], stop
    tag = _TAG.match(text, start)
    if tag is None:
        return text[start:], len(text)
    return "<" + _escaped(tag.group()[1:]).replace("<", "&lt;"), tag.end()


def _behind(text: str, end: str, start: int) -> int:
    found = text.find(end, start)
    return len(text) if found < 0 else found + len(end)


def _escaped(text: str) -> str:
    return _LOOSE_AMPERSAND.sub("&amp;", text)


def _without_blanks_before_declaration(text: str) -> str:
    """Return a document without its declaration if blanks come before it; its line breaks stay."""
    bare = text.lstrip()
    if bare == text or not bare.startswith("<?xml"):
        return text
    stop = _behind(text, "?>", 0)
    return "\n" * text.count("\n", 0, stop) + text[stop:]
