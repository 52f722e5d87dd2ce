"""Every command needs a folder to be in, and one for the systems' files."""

from __future__ import annotations

from pathlib import Path

from regraft.run_directory import home


class BadSurroundings(Exception):
    """A command cannot run here; the text states why and what would be right."""


def check_surroundings() -> None:
    """Make sure that the working folder is there, and that there is a home; raises BadSurroundings."""
    try:
        Path.cwd()
    except OSError as error:
        problem = f"the working folder is not there any more ({error.strerror}): change to another one"
        raise BadSurroundings(problem) from None
    try:
        home()
    except RuntimeError:
        raise BadSurroundings(
            "there is no home folder for the systems' files: set REGRAFT_HOME to a folder, or HOME"
        ) from None
