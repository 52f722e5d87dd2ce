"""Where studies are: in the folders ``studies`` of the stacks, in installed packages, or at a given place."""

from __future__ import annotations

from importlib import import_module
from importlib.metadata import entry_points
from pkgutil import iter_modules
from typing import Any, Final

from regraft.bus_schema.suggestions import instead_of
from regraft.evaluation.study import Study
from regraft.process.modules import CannotImport, after_failure, imported

ENTRY_POINTS: Final = "regraft.studies"
"""The entry point group of studies from other packages: each is a `Study`."""
STACKS: Final = "regraft.stacks"
FOLDER: Final = "studies"
NAME: Final = "STUDY"
"""The name under which a module of a folder of studies has its study; one without is a part of another."""


class NoSuchStudy(ValueError):
    """There is no such study; the text states which there are."""


def find_study(name: str) -> Study:
    """Return the study of that name, or at ``module:NAME``; raises NoSuchStudy."""
    if ":" in name:
        return _study_at(name)
    found = studies()
    if name not in found:
        raise NoSuchStudy(f"there is no study {name!r}; {instead_of(name, found)}")
    return found[name]


def studies() -> dict[str, Study]:
    """Return all studies that can be found, by name; raises NoSuchStudy for two of one name."""
    places = [f"{module}:{NAME}" for module in _modules()]
    places += [entry.value for entry in sorted(entry_points(group=ENTRY_POINTS), key=lambda entry: entry.name)]
    found: dict[str, Study] = {}
    for place in places:
        study = _study_at(place)
        if found.setdefault(study.name, study) is not study:
            raise NoSuchStudy(f"{place}: there is another study named {study.name!r}: rename one of them")
    return dict(sorted(found.items()))


def _modules() -> list[str]:
    """Return the modules in the folders of studies that have one."""
    found = []
    for stack in iter_modules(import_module(STACKS).__path__):
        try:
            folder = import_module(f"{STACKS}.{stack.name}.{FOLDER}")
        except ModuleNotFoundError as error:
            if error.name != f"{STACKS}.{stack.name}.{FOLDER}":
                raise NoSuchStudy(f"{STACKS}.{stack.name}.{FOLDER}: {error}") from None
            continue
        names = [f"{folder.__name__}.{module.name}" for module in iter_modules(folder.__path__)]
        found += [name for name in names if hasattr(import_module(name), NAME)]
    return found


def _study_at(place: str) -> Study:
    module, _, name = place.partition(":")
    try:
        study: Any = getattr(imported(module), name)
    except (CannotImport, AttributeError) as error:
        hint = after_failure(module, error) if isinstance(error, AttributeError) else ""
        raise NoSuchStudy(f"no study at {place!r} (must be module:NAME): {error}{hint}") from None
    if not isinstance(study, Study):
        raise NoSuchStudy(f"{place!r} is {type(study).__name__}, must be a Study")
    return study
