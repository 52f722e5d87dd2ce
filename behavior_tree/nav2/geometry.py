"""The view that Nav2's decorators have of poses, goals and paths, in messages of any form.

- A position (m) is the first of ``pose``, ``position``, and ``x`` and ``y``, in an object or mapping. In a sequence it
  is the first two numbers, in a text ``1.0;2.0`` also.
- A stamp is found in ``header`` and ``stamp``, as seconds or as ``sec`` and ``nanosec``; 0 where there is none.
- A path is a sequence of poses, or has one in ``poses`` or ``points``.
"""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

Position = tuple[float, float]


def position_of(pose: Any) -> Position:
    """Return where a pose is, in metres.

    Raises:
        ValueError: The value has no position.
    """
    place = pose
    for name in ("pose", "pose", "position"):  # a named goal has a pose with a frame, which has a pose
        inner = _part(place, name)
        place = place if inner is None else inner
    if isinstance(place, str):
        place = place.split(";")
    x, y = _part(place, "x"), _part(place, "y")
    if x is None and not isinstance(place, str | Mapping) and hasattr(place, "__getitem__"):
        try:
            x, y = place[0], place[1]
        except (LookupError, TypeError):
            x = y = None
    try:
        return float(x), float(y)
    except (TypeError, ValueError):
        raise ValueError(f"{pose!r} is no pose; it needs x and y, or two numbers") from None


def same_pose(first: Any, second: Any) -> bool:
    """Return whether two poses are equal, whenever they were stamped."""
    bare = [_part(pose, "pose") for pose in (first, second)]
    return same(*bare) if None not in bare else same(first, second)


def stamp_of(goal: Any) -> float:
    """Return when a goal was given, in seconds; 0 where it has no stamp."""
    header = _part(goal, "header")
    stamp = _part(goal if header is None else header, "stamp")
    seconds = _part(stamp, "sec")
    try:
        if seconds is None:
            return float(stamp or 0.0)
        return float(seconds) + float(_part(stamp, "nanosec") or 0) * 1e-9
    except (TypeError, ValueError):
        return 0.0


def poses_of(path: Any) -> Sequence[Any]:
    """Return the poses of a path; none where there is no path.

    Raises:
        ValueError: The value is no path.
    """
    for name in ("poses", "points"):
        inner = _part(path, name)
        path = path if inner is None else inner
    if path is None:
        return ()
    if isinstance(path, str | Mapping) or not hasattr(path, "__getitem__") or not hasattr(path, "__len__"):
        raise ValueError(f"{path!r} is no path; it needs a sequence of poses")
    poses: Sequence[Any] = path
    return poses


def length_of(poses: Sequence[Any]) -> float:
    """Return the length of a path in metres."""
    positions = [position_of(pose) for pose in poses]
    return sum(math.dist(first, second) for first, second in pairwise(positions))


def same(first: Any, second: Any) -> bool:
    """Return whether two values are equal, also where comparing gives one answer for each element."""
    if first is second:
        return True
    equal = first == second
    if isinstance(equal, bool):
        return equal
    try:
        return bool(equal.all())
    except AttributeError:
        return bool(equal)


def _part(value: Any, name: str) -> Any:
    """Return an attribute or a key of a value, None if there is none."""
    if isinstance(value, Mapping):
        return value.get(name)
    return getattr(value, name, None)
