"""Hints for paths that do not exist."""

from __future__ import annotations

from pathlib import Path

from regraft.bus_schema.suggestions import near


def instead_of_path(file: Path) -> str:
    """Return which path may be meant, as the end of a sentence; empty if none is near.

    The first part of the path that does not exist is what is mistyped.
    """
    missing = next((path for path in (*reversed(file.parents), file) if not path.exists()), file)
    try:
        meant = near(missing.name, [path.name for path in missing.parent.iterdir()])
    except OSError:
        meant = None
    return f"; did you mean {str(missing.parent / meant / file.relative_to(missing))!r}?" if meant else ""
