"""Imports authors' modules, which may run any code, with hints for those that do not exist."""

from __future__ import annotations

import gc
import importlib
import importlib.util
import os
import pkgutil
import sys
from collections.abc import Callable, Collection, Iterable
from contextlib import suppress
from pathlib import Path
from types import ModuleType

from regraft.bus_schema.suggestions import near
from regraft.bus_schema.texts import text_of

EXIT_OF_COPIES = 1
OUR_FOLDER = Path(__file__).parents[1]


class CannotImport(Exception):
    """A module cannot be imported; the text states why."""


def imported(name: str, in_copy: Callable[[], object] = lambda: None) -> ModuleType:
    """Return a module, imported if it is not yet.

    A module may fork this process. A copy that comes back from the import would run the whole program a second time:
    it calls ``in_copy`` and ends here.

    Raises:
        CannotImport: it raised anything, leaving included.
    """
    process = os.getpid()
    collecting = gc.isenabled()
    gc.disable()  # an import leaves hardly any garbage
    try:
        return importlib.import_module(name)
    except KeyboardInterrupt:
        raise
    except ImportError as error:
        raise CannotImport(f"cannot import {name!r}: {line_of(error)}{after_failure(name, error)}") from error
    except BaseException as error:
        why = f"{type(error).__name__}: {line_of(error)}{after_failure(name, error)}"
        raise CannotImport(f"importing {name!r} failed: {why}") from error
    finally:
        if collecting:
            gc.enable()
        if os.getpid() != process:
            try:
                in_copy()
            finally:
                os._exit(EXIT_OF_COPIES)


def line_of(error: BaseException) -> str:
    """Return an exception's text on one line; empty if asking for it fails."""
    return " ".join(text_of(error).split())


def instead_of_module(name: str, error: ImportError) -> str:
    """Return which module may be meant by ``name`` if its import failed, as the end of a sentence.

    Empty if there is none near, or if another module is what is missing.
    """
    missing = error.name or ""
    if not isinstance(error, ModuleNotFoundError) or not (name == missing or name.startswith(f"{missing}.")):
        return ""
    ours = OUR_FOLDER.joinpath(*name.split("."))
    if ours.is_dir() or ours.with_suffix(".py").is_file():
        return f"; did you mean {f'{OUR_FOLDER.name}.{name}'!r}?"
    parent, _, child = missing.rpartition(".")
    meant = near(child, _children(parent))
    return f"; did you mean {missing[: -len(child)] + meant + name[len(missing) :]!r}?" if meant else ""


def _children(package: str) -> list[str]:
    """Return the modules of a package that was imported already, for an empty name those on the path."""
    if package:
        places = list(getattr(sys.modules.get(package), "__path__", ()))
        return [module.name for module in pkgutil.iter_modules(places)]
    names = [module.name for module in pkgutil.iter_modules()]
    for place in sys.path:
        with suppress(OSError):  # most often no folder, or another user's
            names += filter(str.isidentifier, os.listdir(place or "."))  # packages need no __init__.py
    return names


def after_failure(name: str, error: BaseException) -> str:
    """Report why importing ``name`` may have failed, as the end of a sentence; empty if nothing is known.

    A module that is found first may hide the one that is meant: ``name`` itself, or one that it imports.
    """
    obj = getattr(error, "obj", None)
    missing = error.name if isinstance(error, ImportError) else getattr(obj, "__name__", "")
    hidden = hidden_by_another(name) or hidden_by_another(missing or "")
    if hidden:
        return f"; {hidden}"
    return instead_of_module(name, error) if isinstance(error, ImportError) else ""


def hidden_by_another(name: str) -> str:
    """Report that a module which is found first hides a file on the path that may be meant; empty if none does."""
    package = name.partition(".")[0]
    return next(filter(None, (_hiding(package, hidden) for hidden in dict.fromkeys((name, package)))), "")


def hidden_file(name: str) -> str:
    """Report that ``name`` was found in one place and hides another of exactly that name; empty if it does not."""
    return _hiding(name.partition(".")[0], name)


def hidden_in(folder: Path, name: str, others: Collection[Path]) -> str:
    """Report that a module of one of ``others`` hides that of a folder; empty if none does. Nothing is imported."""
    package = name.partition(".")[0]
    try:
        spec = importlib.util.find_spec(package)
    except (ImportError, ValueError):
        return ""
    known = [*(spec.submodule_search_locations or (spec.origin,))] if spec is not None else []
    if spec is not None and spec.origin is None:  # folders without __init__.py are one package: the first one counts
        known = [place for place in known if place and _other_file((), name, (Path(place).parent,))][:1]
    among = {Path(place).resolve().parent for place in known if place} & {other.resolve() for other in others}
    return _hides(package, _other_file(known, name, (folder,)) if among else None)


def _hiding(package: str, name: str) -> str:
    found = sys.modules.get(package)
    if found is None or not name:
        return ""
    known = [getattr(found, "__file__", None), *getattr(found, "__path__", ())]
    return _hides(package, _other_file(known, name, map(Path, dict.fromkeys(place or "." for place in sys.path))))


def _hides(package: str, file: Path | None) -> str:
    of = "of the standard library " if package in sys.stdlib_module_names else ""
    return f"the module {package!r} {of}hides {file}: rename that" if file else ""


def _other_file(known: Iterable[str | None], name: str, folders: Iterable[Path]) -> Path | None:
    """Return the first file of folders that a module's name represents, and that is not at a ``known`` place."""
    places = {Path(place).resolve() for place in known if place}
    for folder in folders:
        module = folder.joinpath(*name.split("."))
        for file in (module.with_suffix(".py"), module / "__init__.py"):
            if os.path.isfile(file) and not places & {file.resolve(), *file.resolve().parents}:
                return file
    return None


def package_folder(package: str) -> Path | None:
    """Return where a package is, without importing any part of it."""
    top, *inside = package.split(".")
    spec = importlib.util.find_spec(top)
    places = spec.submodule_search_locations if spec is not None else None
    return Path(next(iter(places)), *inside) if places else None
