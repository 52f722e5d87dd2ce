"""Maps as files: a picture and a YAML file next to it, as ROS's map_server writes and reads them.

https://wiki.ros.org/map_server, "Map format".
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import yaml
from numpy.typing import NDArray

from regraft.services.mapper.maps.grid import Cells

OCCUPIED_FROM, FREE_BELOW = 0.65, 0.196
OCCUPIED_SHADE, FREE_SHADE, UNKNOWN_SHADE = 0, 254, 205
MODES = ("trinary", "scale", "raw")
LARGEST = 64 * 1024 * 1024
"""Bytes of a picture that is read at the most."""


class BadMapFile(ValueError):
    """A map file cannot be read or written; the text states what is wrong with it."""


@dataclass(frozen=True, slots=True, eq=False)
class FiledMap:
    """A map: occupancies in per cent (-1 unknown; rows along y), side of a cell and corner of cell (0, 0) in m."""

    cells: Cells
    resolution: float
    x: float
    y: float


def yaml_path(name: str) -> Path:
    """Return the path of the YAML file that a name means: with or without its ending.

    Raises:
        BadMapFile: the name is empty, or has another ending.
    """
    path = Path(name)
    if not path.name:
        raise BadMapFile("a map needs the name of a file")
    if path.suffix in (".yaml", ".yml"):
        return path
    if path.suffix in (".png", ".pgm"):
        raise BadMapFile(f"{name!r} must name the map's YAML file, not its picture")
    return path.with_name(path.name + ".yaml")


def save(path: Path, saved: FiledMap) -> None:
    """Write ``path`` (YAML) and a PNG of the same name; what was there is replaced at once or stays.

    Raises:
        BadMapFile: it cannot be written.
    """
    shades = np.full(saved.cells.shape, UNKNOWN_SHADE, np.uint8)
    shades[saved.cells >= round(100 * OCCUPIED_FROM)] = OCCUPIED_SHADE
    # Every cell on the free side is called free, or a wall's fringe would be forgotten with each saving.
    shades[(saved.cells >= 0) & (saved.cells < 50)] = FREE_SHADE
    picture = path.with_suffix(".png")
    _, encoded = cv2.imencode(".png", shades[::-1])
    facts = {
        "image": picture.name,
        "mode": "trinary",
        "resolution": saved.resolution,
        "origin": [saved.x, saved.y, 0.0],
        "negate": 0,
        "occupied_thresh": OCCUPIED_FROM,
        "free_thresh": FREE_BELOW,
    }
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _replace(picture, encoded.tobytes())
        _replace(path, yaml.safe_dump(facts, sort_keys=False, default_flow_style=None).encode())
    except OSError as error:
        raise BadMapFile(f"{path} cannot be written: {error.strerror or error}") from None


def _replace(path: Path, content: bytes) -> None:
    beside = path.with_name(f".{path.name}.new")
    beside.write_bytes(content)
    os.replace(beside, path)


def load(path: Path) -> FiledMap:
    """Read a map.

    Raises:
        BadMapFile: a file is missing or broken, or holds what no map can be.
    """
    facts = _facts(path)
    resolution = _number(path, facts, "resolution")
    if not resolution > 0.0:
        raise BadMapFile(f"{path}: 'resolution' must be greater than 0 m, is {resolution}")
    origin = facts.get("origin")
    if not isinstance(origin, list) or len(origin) != 3 or not all(_is_number(part) for part in origin):
        raise BadMapFile(f"{path}: 'origin' must be [x, y, yaw], is {origin!r}")
    if abs(origin[2]) > 1e-6:
        raise BadMapFile(f"{path}: 'origin' is turned by {origin[2]} rad, must not be turned")
    return FiledMap(_occupancies(path, facts), resolution, float(origin[0]), float(origin[1]))


def _facts(path: Path) -> dict[str, Any]:
    try:
        facts = yaml.safe_load(path.read_text("utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise BadMapFile(f"{path} cannot be read: {getattr(error, 'strerror', None) or error}") from None
    except yaml.YAMLError as error:
        raise BadMapFile(f"{path} is no YAML file: {' '.join(str(error).split())}") from None
    if not isinstance(facts, dict):
        raise BadMapFile(f"{path} must hold the keys image, resolution and origin")
    return facts


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _number(path: Path, facts: dict[str, Any], key: str, default: float | None = None) -> float:
    value = facts.get(key, default)
    if value is None:
        raise BadMapFile(f"{path}: {key!r} is missing")
    if not _is_number(value):
        raise BadMapFile(f"{path}: {key!r} must be a number, is {value!r}")
    return float(value)


def _occupancies(path: Path, facts: dict[str, Any]) -> Cells:
    """Return the occupancies in the picture, by the rules of map_server."""
    mode = facts.get("mode", "trinary")
    if mode not in MODES:
        raise BadMapFile(f"{path}: 'mode' must be one of {', '.join(MODES)}, is {mode!r}")
    shades = _shades(path, facts).astype(np.float64)[::-1]
    if mode == "raw":
        return np.where(shades <= 100, shades, -1).astype(np.int8)
    dark = shades / 255.0 if _number(path, facts, "negate", 0) else (255.0 - shades) / 255.0
    occupied_from = _number(path, facts, "occupied_thresh", OCCUPIED_FROM)
    free_below = _number(path, facts, "free_thresh", FREE_BELOW)
    if not 0.0 <= free_below < occupied_from <= 1.0:
        raise BadMapFile(f"{path}: needs 0 <= free_thresh < occupied_thresh <= 1, has {free_below}, {occupied_from}")
    between = np.round(100.0 * (dark - free_below) / (occupied_from - free_below)) if mode == "scale" else -1.0
    return np.where(dark > occupied_from, 100, np.where(dark < free_below, 0, between)).astype(np.int8)


def _shades(path: Path, facts: dict[str, Any]) -> NDArray[np.uint8]:
    name = facts.get("image")
    if not isinstance(name, str) or not name:
        raise BadMapFile(f"{path}: 'image' must name the map's picture, is {name!r}")
    picture = path.parent / name
    try:
        size = picture.stat().st_size
        if size > LARGEST:
            raise BadMapFile(f"{picture} has {size} bytes, must have at most {LARGEST}")
        content = np.frombuffer(picture.read_bytes(), np.uint8)
    except OSError as error:
        raise BadMapFile(f"{picture} cannot be read: {error.strerror or error}") from None
    shades = cv2.imdecode(content, cv2.IMREAD_GRAYSCALE) if len(content) else None
    if shades is None:
        raise BadMapFile(f"{picture} is no picture that can be read")
    return np.asarray(shades, np.uint8)
