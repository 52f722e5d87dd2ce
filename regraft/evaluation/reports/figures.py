"""Figures of reports, with matplotlib where it is installed (the extra ``plots``)."""

from __future__ import annotations

import importlib
import io
from collections.abc import Callable
from typing import Any

NEEDS = "matplotlib is not installed ('pip install regraft[plots]'): there are no figures"
COLOURS = ("#1f4e79", "#d1495b", "#4c9f70", "#8a6d1d", "#7b4ea3", "#3a8fb7", "#b5651d", "#6b6b6b")
"""One for each configuration; they differ in lightness too."""


def pyplot() -> Any:
    """Return matplotlib's pyplot, drawing into files only, None if it is not installed."""
    try:
        importlib.import_module("matplotlib").use("Agg")
        return importlib.import_module("matplotlib.pyplot")
    except ModuleNotFoundError:
        return None


def drawn(draw: Callable[[Any], Any]) -> bytes | None:
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
