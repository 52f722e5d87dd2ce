"""Lines of YAML that strict parsers, ROS 2's too, read as they are meant."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Final

from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import Value

SPECIAL: Final = frozenset(("null", "true", "false", "yes", "no", "on", "off", "y", "n"))
"""Words that are no texts in YAML 1.1, in any case."""
ESCAPES: Final = {'"': '\\"', "\\": "\\\\", "\n": "\\n", "\t": "\\t", "\r": "\\r"}


def word(name: str) -> str:
    """Return a name as a key or a plain value."""
    return f'"{name}"' if name.lower() in SPECIAL else name


def scalar(value: Value) -> str:
    """Return a value with its type: texts in quotes, numbers of 64 bits with a point.

    >>> [scalar(value) for value in (True, 2, 0.2, 1e-7, "a")]
    ['true', '2', '0.2', '1.0e-07', '"a"']
    """
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        digits, mark, exponent = repr(value).partition("e")
        # YAML 1.1 reads 1e-07 as a text.
        return f"{digits}{'' if '.' in digits else '.0'}{mark}{exponent}"
    return str(value) if isinstance(value, int) else f'"{"".join(map(_escaped, value))}"'


def names_below(key: str, names: Iterable[str], indent: str) -> Iterator[str]:
    """Yield names as one folded scalar, one name a line: ROS 2's parser takes no list of texts here."""
    every = tuple(names)
    if len(every) < 2:
        yield f"{indent}{key}: {word(every[0]) if every else scalar('')}"
        return
    yield f"{indent}{key}:"
    yield from (f"{indent}  {name}" for name in every)


def _escaped(character: str) -> str:
    if character in ESCAPES:
        return ESCAPES[character]
    if character.isprintable():
        return character
    code = ord(character)
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"
