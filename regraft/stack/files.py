"""Finds the files that parameters name, before what reads them starts."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.description import PATH, Description
from regraft.stack.relative_paths import is_in_run_folder
from regraft.stack.yaml.path_hints import instead_of_path


def file_problems(description: Description, values: Mapping[str, PlainValue]) -> Iterator[tuple[str, str]]:
    """Yield each parameter of ``values``, or field of a record, that names a missing file, and what is wrong.

    The paths are absolute. Those in the folder of the running system, which is not known yet, are not judged.
    """
    for parameter in description.parameters:
        value = values.get(parameter.name)
        named = [(parameter.name, value)] if parameter.exists else _in_records(parameter.schema, value, parameter.name)
        for place, file in named:
            if isinstance(file, str) and file and not is_in_run_folder(file):
                problem = _file_problem(file)
                yield from [(place, f"{file!r}: {problem}")] if problem else []


def _in_records(schema: PlainValue, value: PlainValue, place: str) -> Iterator[tuple[str, PlainValue]]:
    """Yield the fields of records that name a file, and their values."""
    if isinstance(value, list):
        for index, item in enumerate(value):
            yield from _in_records(schema.get("items", {}), item, f"{place}.{index}")
    elif isinstance(value, dict):
        for name, field in schema.get("properties", {}).items():
            yield from _in_records(field, value.get(name), f"{place}.{name}")
    elif schema.get("x-unit") == PATH:
        yield place, value


def _file_problem(value: str) -> str | None:
    file = Path(value)
    try:
        if not file.exists():
            return f"there is no such file{instead_of_path(file)}"
        if not file.is_file():
            return "is not an ordinary file"
        return None if os.access(file, os.R_OK) else "this user may not read it"
    except (OSError, ValueError) as error:
        return f"cannot be read: {getattr(error, 'strerror', None) or error}"
