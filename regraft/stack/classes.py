"""Finds component classes and modules of message types, in the stack's folder too."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

from bus_schema.description import Description
from regraft.component import describe
from regraft.process import NoSuchClass, load_class


def look_in(folder: Path) -> None:
    """Let this process import the stack's own modules; they come last, so they hide nobody else's."""
    if str(folder) not in sys.path:
        sys.path.append(str(folder))


def import_problem(module: str) -> str | None:
    """Import a module; return why it cannot be, None if it was."""
    try:
        importlib.import_module(module)
    # An author's module may do anything while it is imported, leaving included.
    except (Exception, SystemExit) as error:
        return f"cannot import {module!r}: {type(error).__name__}: {error}"
    return None


def describe_class(path: str) -> Description:
    """Return what the class at ``module:Class`` says of itself; raises NoSuchClass."""
    try:
        return describe(load_class(path))
    except NoSuchClass:
        raise
    except (Exception, SystemExit) as error:
        raise NoSuchClass(f"{path!r} cannot be described: {type(error).__name__}: {error}") from None
