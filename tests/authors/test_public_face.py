"""A file pins the names that authors import, with their parameters: a change of these is a change of that file."""

from __future__ import annotations

import inspect
from collections import defaultdict
from collections.abc import Callable, Iterator
from enum import Enum
from inspect import Parameter
from pathlib import Path
from typing import Any

import behavior_tree
import regraft
from regraft import client, testing

PROMISED = Path(__file__).parent / "public_face.txt"
STARS: defaultdict[object, str] = defaultdict(str, {Parameter.VAR_POSITIONAL: "*", Parameter.VAR_KEYWORD: "**"})


def face() -> Iterator[str]:
    """Yield a line for each name, and for each public member of a class that it has not from another one here."""
    named = [
        (f"{module.__name__}.{name}", getattr(module, name))
        for module in (behavior_tree, regraft, client, testing)
        for name in sorted(module.__all__)
    ]
    public = [value for _, value in named if isinstance(value, type)]
    for path, value in named:
        yield from _lines(path, value, public)


def _lines(path: str, value: Any, public: list[type]) -> Iterator[str]:
    if isinstance(value, type) and issubclass(value, Enum):
        yield f"{path}: {', '.join(value.__members__)}"
    elif isinstance(value, type):
        made_by = inspect.getattr_static(value, "__init__")
        is_made = inspect.isfunction(made_by) and not getattr(value, "_is_protocol", False)
        yield f"{path}{_parameters(value) if is_made else ''}"
        for name in sorted(dir(value)):
            if not name.startswith("_") and _is_new(value, name, public):
                member = inspect.getattr_static(value, name)
                member = member.__func__ if isinstance(member, classmethod | staticmethod) else member
                yield f"{path}.{name}{_parameters(member) if inspect.isfunction(member) else ''}"
    else:
        yield f"{path}{_parameters(value) if inspect.isroutine(value) else ''}"


def _is_new(cls: type, name: str, public: list[type]) -> bool:
    owner = next(base for base in cls.__mro__ if name in vars(base))
    ours = owner.__module__.split(".")[0] in ("behavior_tree", "regraft")
    return ours and (owner is cls or owner not in public)


def _parameters(called: Callable[..., object]) -> str:
    """Return the names of parameters, in brackets; those with a default have an equals sign."""
    shown: list[str] = []
    for parameter in inspect.signature(called).parameters.values():
        if parameter.kind is Parameter.KEYWORD_ONLY and not any(each.startswith("*") for each in shown):
            shown.append("*")
        stars = STARS[parameter.kind]
        shown.append(f"{stars}{parameter.name}{'' if parameter.default is Parameter.empty else '='}")
    return f"({', '.join(shown)})"


def test_what_authors_import_is_what_was_promised() -> None:
    assert list(face()) == PROMISED.read_text().splitlines()
