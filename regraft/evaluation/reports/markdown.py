"""Tables in Markdown, and numbers in their cells."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

UNKNOWN = "–"


def table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table; raises ValueError for a row of another length."""
    lines = [f"| {' | '.join(headings)} |", "|---" * len(headings) + "|"]
    for row in rows:
        if len(row) != len(headings):
            raise ValueError(f"a row has {len(row)} cells, must have {len(headings)}: {list(row)}")
        lines.append(f"| {' | '.join(row)} |")
    return "\n".join(lines) + "\n"


def number(value: float | None, digits: int = 3) -> str:
    """Return a number with so many significant digits.

    >>> number(0.0012345), number(1311.4), number(float("nan")), number(0.0), number(7.08e-10)
    ('0.00123', '1311', '–', '0', '7.08e-10')
    """
    if value is None or not math.isfinite(value):
        return UNKNOWN
    if value == 0.0:
        return "0"
    size = math.floor(math.log10(abs(value)))
    if size < -4:
        return f"{value:.{digits - 1}e}"
    return f"{value:.{max(0, digits - 1 - size)}f}"


def mean_and_sd(mean: float, sd: float) -> str:
    """Return a mean and a standard deviation, the latter with as many decimals.

    >>> mean_and_sd(0.0941, 0.0289)
    '0.0941 ± 0.0289'
    """
    if not math.isfinite(mean):
        return UNKNOWN
    shown = number(mean)
    if not math.isfinite(sd):
        return shown
    decimals = len(shown.partition(".")[2]) if "e" not in shown else None
    return f"{shown} ± {number(sd) if decimals is None or mean == 0.0 else f'{sd:.{decimals}f}'}"


def p_value(p: float) -> str:
    """Return a p value.

    >>> p_value(0.2), p_value(0.0004), p_value(7e-10)
    ('0.200', '0.0004', '7.0e-10')
    """
    if not math.isfinite(p):
        return UNKNOWN
    return f"{p:.3f}" if p >= 0.001 else f"{p:.4f}" if p >= 1e-4 else f"{p:.1e}"
