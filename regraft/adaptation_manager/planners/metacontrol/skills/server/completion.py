"""Proposals for a place of a text, by the words and brackets before it: the text may be half-written."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import Enum
from typing import Final

from regraft.adaptation_manager.planners.metacontrol.skills.checks.interfaces import type_names
from regraft.adaptation_manager.planners.metacontrol.skills.server.known_names import Names

PIECE: Final = re.compile(
    r"""//[^\n]*|/\*[\s\S]*?(?:\*/|\Z)|"(?:\\[\s\S]|[^"\\])*(?:"|\Z)|'(?:\\[\s\S]|[^'\\])*(?:'|\Z)"""
    r"""|[A-Za-z_][A-Za-z0-9_./-]*|[0-9.]+|\S"""
)
WORD: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_./-]*\Z")
OPENING: Final = {"{": "}", "[": "]"}


class Kind(Enum):
    """The kinds of what is proposed."""

    KEYWORD = "keyword"
    SKILL = "skill"
    QUALITY = "quality"
    CONTEXT = "context"
    COMPONENT = "component"
    CONFIGURATION = "configuration"
    PARAMETER = "parameter"
    TYPE = "type"
    VALUE = "value"


@dataclass(frozen=True, slots=True)
class Proposal:
    """A word that may stand at a place."""

    text: str
    kind: Kind


TOP = ("import", "Skill", "Realization", "Quality", "Context", "Component", "SkillDefinitionSet")
INSIDE: Final[dict[str, tuple[str, ...]]] = {
    "": TOP,
    "SkillDefinitionSet": TOP[1:-1],
    "Skill": ("quality attributes", "input", "output", "result", "Realization"),
    "Realization": ("Component", "Quality", "requires", "context"),
    "Quality": ("better", "range", "measured", "weight", "curve"),
    "result": ("success", "error", "inprogress"),
    "Component": ("Configuration",),
}
"""The keywords inside of each block, by the word that begins it."""

BEGINNING: Final = frozenset((*INSIDE, "Configuration", "requires", "attributes", "input", "output", "curve")) - {""}
"""Words that begin what is between brackets."""


@dataclass(frozen=True, slots=True)
class _Block:
    """An open bracket: the word that begins its block, and the name behind it."""

    mark: str
    word: str
    name: str


def proposals(text: str, offset: int, names: Names) -> list[Proposal]:
    """Return what may stand at an offset of a text; the editor leaves out what does not fit the word there."""
    before = text[:offset]
    begun = WORD.search(before)
    pieces = [each[0] for each in PIECE.finditer(before[: begun.start()] if begun else before)]
    if pieces and _is_unfinished(pieces[-1], before):
        return []
    blocks = _blocks(pieces)
    return list(_proposed(pieces, blocks, names))


def _is_unfinished(piece: str, before: str) -> bool:
    """Return whether a place is in a comment or a text."""
    if piece.startswith("//"):
        return "\n" not in before[before.rfind(piece) :]
    if piece.startswith("/*"):
        return not piece.endswith("*/") or len(piece) < 4
    return piece[0] in "\"'" and (len(piece) < 2 or piece[-1] != piece[0])


def _blocks(pieces: list[str]) -> list[_Block]:
    """Return the brackets that are open at the end."""
    found: list[_Block] = []
    start = 0
    for index, piece in enumerate(pieces):
        if piece in OPENING:
            words = [each for each in pieces[start:index] if each[0].isalpha() or each[0] == "_"]
            found.append(_block(piece, words))
            start = index + 1
        elif piece in "}]":
            while found and OPENING[found.pop().mark] != piece:
                pass
            start = index + 1
        elif piece in ",;":
            start = index + 1
    return found


def _block(mark: str, words: list[str]) -> _Block:
    """Return the block that some words begin: the last keyword of them counts."""
    for index in range(len(words) - 1, -1, -1):
        if words[index] in BEGINNING:
            return _Block(mark, words[index], words[index + 1] if index + 1 < len(words) else "")
    return _Block(mark, "", "")


def _proposed(pieces: list[str], blocks: list[_Block], names: Names) -> Iterator[Proposal]:
    last = pieces[-1] if pieces else ""
    word = pieces[-2] if last == ":" and len(pieces) > 1 else ""
    inside = blocks[-1] if blocks else _Block("{", "", "")
    if last in ("of", "requires"):
        yield from _all(names.skills, Kind.SKILL)
    elif word == "context":
        yield from _all(names.contexts, Kind.CONTEXT)
    elif word == "better":
        yield from _all(("higher", "lower"), Kind.VALUE)
    elif last == ":" and inside.word in ("input", "output"):
        yield from _all(type_names(), Kind.TYPE)
    elif last == ":" and inside.word == "Configuration":
        yield from _all(("true", "false"), Kind.VALUE)
    elif last == "Component":
        yield from _all(names.components, Kind.COMPONENT)
    elif len(pieces) > 1 and pieces[-2] == "Component":
        yield Proposal("observable", Kind.KEYWORD)
        yield from _all(names.of_component(last), Kind.CONFIGURATION)
    elif len(pieces) > 2 and pieces[-3] == "Component" and last == "observable":
        yield from _all(names.of_component(pieces[-2]), Kind.CONFIGURATION)
    elif last == "Configuration":
        component = next((each.name for each in reversed(blocks) if each.word == "Component"), "")
        yield from _all(names.of_component(component), Kind.CONFIGURATION)
    elif inside.mark == "[":
        if last in "[," and inside.word != "curve":
            yield from _all(names.qualities, Kind.QUALITY)
    elif inside.word == "Configuration" and last in "{,":
        component = next((each.name for each in reversed(blocks) if each.word == "Component"), "")
        yield from _all(names.parameters.get(component, ()), Kind.PARAMETER)
    elif last != ":" and last not in TOP:
        yield from _all(INSIDE.get(inside.word, ()), Kind.KEYWORD)


def _all(words: Iterable[str], kind: Kind) -> Iterator[Proposal]:
    return (Proposal(each, kind) for each in words)
