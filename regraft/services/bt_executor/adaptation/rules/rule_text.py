"""Takes the text of a rule table apart; the text between the marks is left to the script language."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from regraft.bus_schema.model.lifecycle import Transition

# All repetitions are possessive: a pattern that cannot match fails in one pass over the text.
_NAME: Final = r"/?[A-Za-z_]\w*+(?:\.[A-Za-z_]\w*+)*+"
_SET: Final = re.compile(rf"(?:set\s++)?(?P<target>{_NAME})\s*+(?P<operator>:=|\+=|-=|=(?!=))")
_CONNECT: Final = re.compile(rf"connect\s++(?P<target>{_NAME})\s++to\s++(?P<topic>[\w./-]++)\s*+")
_DISCONNECT: Final = re.compile(rf"disconnect\s++(?P<target>{_NAME})\s*+")
_TRANSITIONS: Final = "|".join(each.value for each in Transition if each is not Transition.SHUTDOWN)
_CHANGE_STATE: Final = re.compile(rf"(?P<transition>{_TRANSITIONS})(?:\s++(?P<component>{_NAME}))?\s*+")
_WITHIN: Final = "within"

MAX_TABLE_LENGTH: Final = 10_000
"""Characters of a rule table."""
MAX_SHOWN_LENGTH: Final = 200
ACTION_FORMS: Final = (
    "PARAMETER := VALUE, PARAMETER += VALUE, PARAMETER -= VALUE, each with 'within [LOW, HIGH]' if wanted; "
    "connect PORT to TOPIC; disconnect PORT; configure, activate, deactivate or cleanup COMPONENT"
)


@dataclass(frozen=True, slots=True)
class SetText:
    """``target operator value within [low, high]``; the last three are scripts, the bounds may be absent."""

    target: str
    operator: str
    value: str
    low: str
    high: str


@dataclass(frozen=True, slots=True)
class ConnectText:
    """``connect target to topic``, or ``disconnect target``: the target is a port, or ``component.port``."""

    target: str
    topic: str | None


@dataclass(frozen=True, slots=True)
class StateText:
    """``transition component``; the component may be left out."""

    transition: Transition
    component: str


ActionText = SetText | ConnectText | StateText


@dataclass(frozen=True, slots=True)
class RuleText:
    """One rule as written in the table: its own text, its condition (empty: always), and its actions."""

    text: str
    condition: str
    actions: tuple[ActionText, ...]


def read_table(table: str) -> tuple[RuleText, ...]:
    """Return the rules of a table.

    Raises:
        ValueError: a rule is not well-formed, with its number and text, or the table is too long.
    """
    if len(table) > MAX_TABLE_LENGTH:
        raise ValueError(f"the rules have {len(table)} characters: at most {MAX_TABLE_LENGTH}")
    rules = []
    for number, text in enumerate(_parts(table, ";"), start=1):
        if not text:
            continue
        try:
            rules.append(_rule(text))
        except ValueError as error:
            raise ValueError(f"rule {number}, '{shown(text)}': {error}") from None
    if not rules:
        raise ValueError("there is no rule; write CONDITION : ACTION; CONDITION : ACTION")
    return tuple(rules)


def shown(text: str) -> str:
    """Return a rule's text as an error quotes it: not too long."""
    return text if len(text) <= MAX_SHOWN_LENGTH else f"{text[:MAX_SHOWN_LENGTH]}…"


def _rule(text: str) -> RuleText:
    colon = next((at for at, mark in _marks(text) if mark == ":"), None)
    condition, actions = ("", text) if colon is None else (text[:colon].strip(), text[colon + 1 :])
    if colon is not None and not condition:
        raise ValueError("there is no condition before ':'; without one, leave out the ':' as well")
    return RuleText(text, condition, tuple(_action(action) for action in _parts(actions, ",")))


def _action(text: str) -> ActionText:
    found = _CONNECT.fullmatch(text)
    if found:
        return ConnectText(found["target"], found["topic"])
    found = _DISCONNECT.fullmatch(text)
    if found:
        return ConnectText(found["target"], None)
    found = _CHANGE_STATE.fullmatch(text)
    if found:
        return StateText(Transition(found["transition"]), found["component"] or "")
    found = _SET.match(text)
    if found and found.end() < len(text):
        value, low, high = _value_and_bounds(text[found.end() :].strip())
        return SetText(found["target"], found["operator"], value, low, high)
    raise ValueError(f"'{shown(text)}' is no action; there are: {ACTION_FORMS}")


def _value_and_bounds(text: str) -> tuple[str, str, str]:
    """Return what is set, and the bounds of ``within [LOW, HIGH]`` behind it, empty where there are none."""
    before, bracket, inside = text.rpartition("[")
    value, word, blank = before.rpartition(_WITHIN)
    low, comma, high = inside.removesuffix("]").partition(",")
    has_bounds = bracket and word and not blank.strip() and value != value.rstrip() and inside.endswith("]")
    if not has_bounds or not value.strip() or not comma or set(",]") & set(high) or "]" in low or not (low and high):
        return text, "", ""
    return value.strip(), low.strip(), high.strip()


def _parts(text: str, separator: str) -> list[str]:
    parts, start = [], 0
    for at, mark in _marks(text):
        if mark == separator:
            parts.append(text[start:at].strip())
            start = at + 1
    return [*parts, text[start:].strip()]


def _marks(text: str) -> Iterator[tuple[int, str]]:
    """Yield each ``;``, ``,`` and ``:`` that separates, with its place.

    Those within quotes, parentheses and brackets do not, nor does the colon of ``:=`` and of ``a ? b : c``.
    """
    depth = questions = 0
    quoted = False
    for at, character in enumerate(text):
        if character == "'":
            quoted = not quoted
        elif quoted:
            continue
        elif character in "([":
            depth += 1
        elif character in ")]":
            depth -= 1
        elif depth == 0 and character == "?":
            questions += 1
        elif depth == 0 and character == ":" and questions:
            questions -= 1
        elif depth == 0 and (character in ";," or (character == ":" and text[at + 1 : at + 2] != "=")):
            questions = 0
            yield at, character
