"""Numbers of options and arguments: each has bounds, and one beyond them is reported with both."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeGuard

import typer

from regraft.bus_schema.model.parameter_values import INT64
from regraft.component.handlers import LONGEST
from regraft.stack.yaml.nodes import NumberTooLarge, Scalar, scalar

MAX_SHOWN_LENGTH = 40


def seconds(least: float, most: float = LONGEST) -> Callable[[str | float], float]:
    """Return a parser of a time."""

    def parse(text: str | float) -> float:
        value = _scalar(text)
        if not _is_number(value) or math.isnan(value):
            raise typer.BadParameter(f"is {_shown(text)}, must be a number of seconds")
        _check(text, value, least, most)
        return float(value)

    return parse


def number(least: float, most: float) -> Callable[[str | float], float]:
    """Return a parser of a number."""

    def parse(text: str | float) -> float:
        value = _scalar(text)
        if not _is_number(value) or math.isnan(value):
            raise typer.BadParameter(f"is {_shown(text)}, must be a number")
        _check(text, value, least, most)
        return float(value)

    return parse


def whole(least: int, most: int = INT64 - 1) -> Callable[[str | int], int]:
    """Return a parser of a whole number."""

    def parse(text: str | int) -> int:
        value = _scalar(text)
        if not _is_number(value) or (math.isfinite(value) and value != int(value)) or math.isnan(value):
            raise typer.BadParameter(f"is {_shown(text)}, must be a whole number")
        _check(text, value, least, most)
        return int(value)

    return parse


def _scalar(text: str | float) -> Scalar:
    """Return what was typed, or a default as it is; ``inf`` and ``nan`` may be typed without YAML's point."""
    if not isinstance(text, str):
        return text
    sign, word = ("-", text[1:]) if text.startswith("-") else ("", text.removeprefix("+"))
    try:
        return scalar(f"{sign}.{word}" if word in ("inf", "nan") else text.strip())
    except NumberTooLarge:
        return -math.inf if sign else math.inf


def _is_number(value: Scalar) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _check(text: str | float, value: float, least: float, most: float) -> None:
    if not least <= value <= most:
        size = "too large" if value > most else "too small"
        raise typer.BadParameter(f"is {_shown(text)}, which is {size}: must be from {_plain(least)} to {_plain(most)}")


def _plain(bound: float) -> str:
    return str(int(bound)) if bound == int(bound) else f"{bound:g}"


def _shown(text: str | float) -> str:
    shown = str(text)
    return repr(shown) if len(shown) <= MAX_SHOWN_LENGTH else f"{shown[:MAX_SHOWN_LENGTH]}... ({len(shown)} characters)"
