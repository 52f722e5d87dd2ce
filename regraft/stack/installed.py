"""Stacks of installed packages, which are run by their names from any folder."""

from __future__ import annotations

from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from regraft.bus_schema.suggestions import near

ENTRY_POINTS: Final = "regraft.stacks"
"""The entry point group of stacks: each names the package whose folder has a ``stack.yaml``."""
STACK_FILE: Final = "stack.yaml"


def stack_file(named: Path) -> Path:
    """Return the file of a stack: ``named`` is a file, a folder with a ``stack.yaml``, or an installed stack.

    An installed stack is named as ``frog``, and another file of its folder as ``frog/search.yaml``. A file or folder
    that is there goes first. A path that is none of these is returned as it is.
    """
    path = named if named.exists() else _installed(named) or named
    return path / STACK_FILE if path.is_dir() else path


def installed_stacks() -> dict[str, Path]:
    """Return the folders of all installed stacks by name."""
    folders = {entry.name: _folder(entry.value) for entry in entry_points(group=ENTRY_POINTS)}
    return {name: folder for name, folder in sorted(folders.items()) if folder is not None}


def instead_of_stack(named: Path) -> str:
    """Say which installed stack may be meant, as the end of a sentence; empty for a path with more than a name."""
    if named != Path(named.name):
        return ""
    names = installed_stacks()
    meant = near(named.name, names)
    return f"; did you mean {meant!r}?" if meant else f"; installed stacks: {', '.join(names) or 'none'}"


def _installed(named: Path) -> Path | None:
    if named.is_absolute() or not named.parts:
        return None
    folder = installed_stacks().get(named.parts[0])
    if folder is None:
        return None
    path = folder.joinpath(*named.parts[1:])
    here = Path.cwd()
    return path.relative_to(here) if path.is_relative_to(here) else path


def _folder(package: str) -> Path | None:
    try:
        spec = find_spec(package)
    except ImportError:
        return None
    places = spec.submodule_search_locations if spec is not None else None
    return Path(next(iter(places))) if places else None
