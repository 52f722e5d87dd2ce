"""A hash of a compiled world, equal wherever its files lie."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator

import mujoco
import numpy as np

PLACES = {"paths", "npaths", "nbuffer"}
"""Fields that depend on the folders of meshes and textures. Other fields have the contents of these files."""


def fingerprint_of(model: mujoco.MjModel) -> str:
    """Return a SHA-256 of everything that MuJoCo knows of a world, except the folders of its files."""
    found = hashlib.sha256()
    for name, value in _fields(model):
        found.update(f"{name} {len(value)} ".encode() + value)
    return found.hexdigest()


def _fields(part: object, within: str = "") -> Iterator[tuple[str, bytes]]:
    """Yield the names and values of a struct's fields, and of those of the structs in it."""
    for field in dir(part):
        if field.startswith("_") or field in PLACES or field.endswith("_pathadr"):
            continue
        name, value = f"{within}{field}", getattr(part, field)
        if isinstance(value, np.ndarray):
            yield name, value.tobytes()
        elif isinstance(value, bytes):
            yield name, value
        elif isinstance(value, int | float):
            yield name, repr(value).encode()
        elif not callable(value):
            yield from _fields(value, f"{name}.")
