"""Parses the text of a file of skills with textX; a syntax error is one error with its place."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import Any, Final

from textx import metamodel_from_file
from textx.exceptions import TextXSyntaxError

from regraft.bus_schema.suggestions import near

GRAMMAR: Final = Path(__file__).with_name("skills.tx")
MAX_TOKENS: Final = 200_000
"""Words and marks of a file. textX takes some 50 us and 1 KB for each."""
TOKEN: Final = re.compile(r"[A-Za-z0-9_.]+|[^\sA-Za-z0-9_.]")
FOUND: Final = re.compile(r"[A-Za-z0-9_.]+|\S")
NAMES: Final = {
    "Identifier": "a name",
    "Name": "a name",
    "DottedName": "a name",
    "DottedComponent": "a component",
    "ParameterName": "a parameter",
    "TypeName": "a type",
    "Number": "a number",
    "Text": "a text",
    "EOF": "the end of the file",
}
"""Rules as people read of them."""


class SyntaxMistake(Exception):
    """A text that is not of the language: where (an offset, and the length of what is there), and what is expected."""

    def __init__(self, start: int, length: int, problem: str) -> None:
        self.start = start
        self.length = length
        super().__init__(problem)


@cache
def _metamodel() -> Any:
    return metamodel_from_file(str(GRAMMAR), autokwd=True)


def token_count(text: str) -> int:
    """Return how many words and marks a text has, at least."""
    return sum(1 for _ in TOKEN.finditer(text))


def parsed(text: str) -> Any:
    """Return textX's model of a text; raises SyntaxMistake."""
    try:
        # Arpeggio looks for the first line's end again for each part, as long as it finds none.
        return _metamodel().model_from_str(f"{text}\n")
    except TextXSyntaxError as error:
        start = min(_offset(f"{text}\n", error.line or 1, error.col or 1), len(text))
        raise _mistake(text, start, error) from None


def _offset(text: str, line: int, column: int) -> int:
    start = 0
    for _ in range(line - 1):
        start = text.find("\n", start) + 1
    return start + column - 1


def _mistake(text: str, start: int, error: TextXSyntaxError) -> SyntaxMistake:
    for mark, kind in (("/*", "comment"), ('"', "text"), ("'", "text")):
        if text.startswith(mark, start):
            closed = re.compile(r"/\*[\s\S]*?\*/|\"(?:\\[\s\S]|[^\"\\])*\"|'(?:\\[\s\S]|[^'\\])*'").match(text, start)
            if closed is None:
                return SyntaxMistake(start, len(mark), f"the {kind} that begins here has no end")
    found = FOUND.match(text, start)
    there = repr(found[0][:40]) if found else "the end of the file"
    wanted = _wanted(error) or ["something else"]
    meant = near(repr(found[0][:40]), wanted) if found else None
    hint = f"; did you mean {meant}?" if meant else ""
    return SyntaxMistake(start, len(found[0]) if found else 0, f"expected {_listed(wanted)}, found {there}{hint}")


def _listed(wanted: list[str]) -> str:
    *others, last = wanted
    return f"{', '.join(others)} or {last}" if others else last


def _wanted(error: TextXSyntaxError) -> list[str]:
    given = error.message.removeprefix("Expected ").split(" or ")
    return list(dict.fromkeys(NAMES.get(each, each) for each in given if each != "Comment"))
