"""Reads the files by which other nodes take the place of a mission's own, in the form of BehaviorTree.CPP."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from behavior_tree import Registry, RegistryError
from regraft.bus_schema.suggestions import instead_of
from regraft.services.bt_executor.source import Unloadable

MAX_SIZE: Final = 1_000_000
"""Bytes of a file with substitution rules."""
MAX_RULES: Final = 1_000
"""Each node of a tree is compared with every rule."""


def with_mocks(registry: Registry, file: Path) -> Registry:
    """Return node types of which those that a file's rules fit are replaced.

    Raises:
        Unloadable: the file cannot be read, is too large or no such file, or a rule names what there is not.
    """
    result = registry.copy()
    text = _text(file)
    try:
        result.substitutions.add_json(text)
    except RegistryError as error:
        raise Unloadable(f"{file}: {error}") from None
    if len(result.substitutions) > MAX_RULES:
        raise Unloadable(f"{file}: SubstitutionRules: {len(result.substitutions)} rules: must be at most {MAX_RULES}")
    for pattern, name in result.substitutions.types.items():
        if name not in result.manifests:
            known = "; there is neither a config nor a node type of this name"
            hint = instead_of(name, result.manifests)
            raise Unloadable(f"{file}: SubstitutionRules: '{pattern}' names '{name}'{known}; {hint}")
    return result


def _text(file: Path) -> str:
    try:
        with file.open("rb") as stream:
            data = stream.read(MAX_SIZE + 1)
        if len(data) > MAX_SIZE:
            raise Unloadable(f"{file}: is too large for substitution rules: must have at most {MAX_SIZE} bytes")
        return data.decode("utf-8-sig")
    except OSError as error:
        raise Unloadable(f"{file}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise Unloadable(f"{file}: cannot be read: it is not in UTF-8: {error.reason}") from None
