"""Figures of reports, with matplotlib where it is installed (the extra ``plots``)."""

from __future__ import annotations

import importlib
import io
from collections.abc import Callable, Mapping
from typing import Any

NEEDS = "matplotlib is not installed ('pip install regraft[plots]'): there are no figures"
COLOURS = ("#1f4e79", "#d1495b", "#4c9f70", "#8a6d1d", "#7b4ea3", "#3a8fb7", "#b5651d", "#6b6b6b")
"""One for each configuration; they differ in lightness too."""

Draw = Callable[[Any], Any]
"""Draws a figure with pyplot, which it is given, and returns it."""


def pyplot() -> Any:
    """Return matplotlib's pyplot, drawing into files only, None if it is not installed."""
    try:
        importlib.import_module("matplotlib").use("Agg")
        return importlib.import_module("matplotlib.pyplot")
    except ModuleNotFoundError:
        return None


def drawn(draw: Draw) -> bytes | None:
    """Return the figure that ``draw(pyplot)`` returns as PNG; None without matplotlib."""
    plot = pyplot()
    if plot is None:
        return None
    figure = draw(plot)
    try:
        content = io.BytesIO()
        figure.savefig(content, format="png", dpi=130, metadata={"Software": None})
        return content.getvalue()
    finally:
        plot.close(figure)


def illustrated(figures: Mapping[str, Draw]) -> tuple[dict[str, bytes], list[str]]:
    """Return the figures as PNG by file name, and the paragraphs that show them; what is missing without matplotlib."""
    pictures = {name: content for name, draw in figures.items() if (content := drawn(draw)) is not None}
    shown = [f"![{name.removesuffix('.png').replace('_', ' ')}]({name})\n" for name in pictures]
    return pictures, shown if pictures or not figures else [f"{NEEDS}.\n"]
