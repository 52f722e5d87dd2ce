"""Stacks and robots of installed packages, which have names that hold in any folder."""

from __future__ import annotations

from functools import cache
from importlib.metadata import entry_points
from pathlib import Path
from typing import Final

from regraft.bus_schema.suggestions import near
from regraft.process.modules import package_folder

ENTRY_POINTS: Final = "regraft.stacks"
"""The entry point group of stacks: each names the package whose folder has a ``stack.yaml``."""
ROBOT_ENTRY_POINTS: Final = "regraft.robots"
"""The entry point group of robots: each names the package whose folder has a ``robot.yaml``."""
STACK_FILE: Final = "stack.yaml"


def stack_file(named: Path) -> Path:
    """Return the file of a stack: ``named`` is a file, a folder with a ``stack.yaml``, or an installed stack.

    An installed stack is named as ``frog``, and another file of its folder as ``frog/search.yaml``. A file or folder
    that is there goes first. Any other path is returned as it is.
    """
    try:
        path = named if named.exists() else _installed(named, ENTRY_POINTS) or named
        return path / STACK_FILE if path.is_dir() else path
    except OSError:  # such as a name that is too long: reading it reports that
        return named


def instead_of_stack(named: Path) -> str:
    """Return which installed stack may be meant, as the end of a sentence; empty for a path with more than a name."""
    return _instead_of(named, ENTRY_POINTS, "stacks")


def instead_of_robot(named: Path) -> str:
    """Return which installed robot may be meant, as ``instead_of_stack`` does."""
    return _instead_of(named, ROBOT_ENTRY_POINTS, "robots")


def installed_robot(name: str) -> Path | None:
    """Return the folder of an installed robot, None if no robot has this name."""
    return _installed(Path(name), ROBOT_ENTRY_POINTS)


@cache
def packages() -> dict[str, str]:
    """Return the folders of the packages that have installed stacks and robots, by their names."""
    entries = (*entry_points(group=ENTRY_POINTS), *entry_points(group=ROBOT_ENTRY_POINTS))
    found = {name: package_folder(name) for name in sorted({entry.value.split(".")[0] for entry in entries})}
    return {name: str(folder) for name, folder in found.items() if folder is not None}


def _instead_of(named: Path, group: str, kind: str) -> str:
    if named != Path(named.name):
        return ""
    names = sorted(entry_points(group=group).names)
    meant = near(named.name, names)
    return f"; did you mean {meant!r}?" if meant else f"; installed {kind}: {', '.join(names) or 'none'}"


def _installed(named: Path, group: str) -> Path | None:
    name, *inside = named.parts or ("",)
    folder = next((package_folder(entry.value) for entry in entry_points(group=group, name=name)), None)
    if folder is None:
        return None
    path = folder.joinpath(*inside)
    try:
        return path.relative_to(Path.cwd())
    except (OSError, ValueError):  # the current folder is gone, or the stack is elsewhere
        return path
