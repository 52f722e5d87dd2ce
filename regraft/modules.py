"""Hints for modules that do not exist."""

from __future__ import annotations

import pkgutil
import sys
from pathlib import Path

from bus_schema.suggestions import near


def instead_of_module(name: str, error: ImportError) -> str:
    """Say which module may be meant by ``name`` if importing it failed for its name, as the end of a sentence.

    Empty if there is none near, or if another module is what is missing.
    """
    missing = error.name or ""
    if not isinstance(error, ModuleNotFoundError) or not (name == missing or name.startswith(f"{missing}.")):
        return ""
    parent, _, child = missing.rpartition(".")
    meant = near(child, _children(parent))
    return f"; did you mean {missing[: -len(child)] + meant + name[len(missing) :]!r}?" if meant else ""


def _children(package: str) -> list[str]:
    """Return the modules of a package that was imported already, for an empty name those on the path."""
    if package:
        places = list(getattr(sys.modules.get(package), "__path__", ()))
        return [module.name for module in pkgutil.iter_modules(places)]
    # Folders without an __init__.py are packages too.
    folders = [
        entry.name for place in sys.path if Path(place or ".").is_dir() for entry in Path(place or ".").iterdir()
    ]
    return [module.name for module in pkgutil.iter_modules()] + [name for name in folders if name.isidentifier()]
