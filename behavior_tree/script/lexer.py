"""Splits a script into tokens."""

import re
from dataclasses import dataclass
from typing import Final

from ..data.values import INT64_MAX, parse_real
from ..errors import ScriptError


@dataclass(frozen=True, slots=True)
class Token:
    """A piece of a script.

    Attributes:
        kind: ``int``, ``hex``, ``real``, ``text``, ``name``, ``operator`` or ``end``.
        text: The characters, without the quotes of a text and the ``0x`` of a hex number.
        column: Where it starts, counted from 1.
    """

    kind: str
    text: str
    column: int


_TOKEN: Final = re.compile(
    r"""(?P<space>(?:\s|\\(?=\s))+)
      | (?P<real>[0-9]+\.[0-9]+(?:[eE][+-]?[0-9]+)?(?!\w) | [0-9]+[eE][+-]?[0-9]+(?!\w))
      | 0[xX](?P<hex>[0-9a-fA-F]+)(?![\w.])
      | (?P<int>[0-9]+)(?!\w|\.(?!\.))
      | '(?P<text>[^']*)'
      | "(?P<quoted>[^"]*)"
      | (?P<name>@?[^\W\d]\w*)
      | (?P<operator>:=|\+=|-=|\*=|/=|\.\.|==|!=|<=|>=|&&|\|\||[-=<>?:|^&+*/~!();,])
    """,
    re.VERBOSE,
)
_KINDS: Final = {"quoted": "text"}
_BASES: Final = {"int": 10, "hex": 16}
_NUMBERS: Final = ("real", *_BASES)
_MAX_DIGITS: Final = 100
"""More digits than any number of 64 bits needs, leading zeros included; Python refuses to read thousands."""
_MAX_SHOWN_LENGTH: Final = 200


def tokenize(script: str, *, extensions: bool = False) -> list[Token]:
    """Return the tokens of a script, closed by an ``end`` token; a line may end with a backslash.

    BehaviorTree.CPP's scripts have no commas, no text in double quotes, and no letters beyond ASCII in names; those
    with our extensions do.

    Raises:
        ScriptError: Some characters form no token, or a number does not fit into 64 bits.
    """
    tokens = []
    position = 0
    while position < len(script):
        found = _TOKEN.match(script, position)
        if found is None or not (extensions or _is_btcpp(found)):
            raise ScriptError(f"{place(script, position)}: cannot read '{script[position:][:12]}'")
        kind = str(found.lastgroup)
        token = Token(_KINDS.get(kind, kind), found.group(kind), position + 1)
        if kind in _NUMBERS and not _fits(token):
            raise ScriptError(f"{place(script, position)}: {found.group()[:30]} does not fit into 64 bits")
        if kind != "space":
            tokens.append(token)
        position = found.end()
    return [*tokens, Token("end", "", len(script) + 1)]


def _is_btcpp(found: re.Match[str]) -> bool:
    foreign = found.lastgroup == "name" and not found.group().isascii()
    return found.group() != "," and found.lastgroup != "quoted" and not foreign


def place(script: str, position: int) -> str:
    """Return where in a script something is wrong, for messages."""
    shown = script if len(script) <= _MAX_SHOWN_LENGTH else f"{script[:_MAX_SHOWN_LENGTH]}…"
    return f"column {position + 1} of '{shown}'"


def _fits(token: Token) -> bool:
    if token.kind == "real":
        try:
            parse_real(token.text)
        except ValueError:
            return False
        return True
    return len(token.text) <= _MAX_DIGITS and int(token.text, _BASES[token.kind]) <= INT64_MAX
