"""Reads the text of a mission file."""

from __future__ import annotations

from pathlib import Path

from regraft.cli.outcomes import BadInput

MAX_TREE_SIZE = 1_000_000


def mission_text(file: Path) -> str:
    """Return a file's text; raises BadInput for one that cannot be read, is too large, or is empty."""
    from behavior_tree.xml.encoding import decode

    try:
        with file.open("rb") as stream:
            data = stream.read(MAX_TREE_SIZE + 1)
        if len(data) > MAX_TREE_SIZE:
            raise BadInput(f"{file}: is too large for a tree: must have at most {MAX_TREE_SIZE} bytes")
        text = decode(data)
    except OSError as error:
        raise BadInput(f"{file}: cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise BadInput(f"{file}: cannot be read: {error}") from None
    if not text.strip():
        raise BadInput(f"{file}: is empty: must be a tree in XML")
    return text
