"""Paths among the parameters of components, which files give relative to their own folders."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.description import Description

RUN_FOLDER = "$RUN"
"""In a path parameter: the folder of the running system (``regraft.run_directory``)."""


def is_in_run_folder(value: object) -> bool:
    """Return whether a value is the folder of the running system, or a path in it."""
    return isinstance(value, str) and (value == RUN_FOLDER or value.startswith(f"{RUN_FOLDER}/"))


def is_relative(value: object) -> bool:
    """Return whether a path is looked for from a folder, rather than empty or in the running system's."""
    return isinstance(value, str) and value != "" and not is_in_run_folder(value)


def with_absolute_paths(
    description: Description, parameters: dict[str, PlainValue], folders: Path | Mapping[str, Path]
) -> dict[str, PlainValue]:
    """Return the parameters, those whose unit is ``path`` made absolute from a folder, or from one for each.

    Empty ones stay, and so do those that begin with ``$RUN``: the folder of the running system is not known yet.
    """
    paths = {parameter.name for parameter in description.parameters if parameter.unit == "path"}
    return {
        name: str((folders if isinstance(folders, Path) else folders[name]) / value)
        if name in paths and is_relative(value) and (isinstance(folders, Path) or name in folders)
        else value
        for name, value in parameters.items()
    }


def with_run_folder(parameters: Mapping[str, PlainValue], folder: str) -> dict[str, PlainValue]:
    """Return the parameters, those that begin with ``$RUN`` in the folder of the running system."""
    return {
        name: value.replace(RUN_FOLDER, folder, 1) if is_in_run_folder(value) else value
        for name, value in parameters.items()
    }
