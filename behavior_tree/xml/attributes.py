"""Sorts the attributes of an element and compiles its conditions."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from functools import lru_cache
from typing import Any, Final

from ..data.blackboard import Blackboard
from ..errors import ScriptError
from ..nodes.manifest import CONDITION_ATTRIBUTES, NodeKind, NodeManifest, has_control_character
from ..nodes.node import Conditions
from ..nodes.runtime import Runtime
from ..script import compile_condition, compile_script
from .document import Element

_FIELDS: Final = {
    "_failureIf": "failure_if",
    "_successIf": "success_if",
    "_skipIf": "skip_if",
    "_while": "while_true",
    "_onHalted": "on_halted",
    "_onFailure": "on_failure",
    "_onSuccess": "on_success",
    "_post": "post",
}
_KNOWN: Final = ("_autoremap", *CONDITION_ATTRIBUTES)
_LONGEST_MISSPELT: Final = 30
"""Longer attributes are similar to none of these."""
_ASKED: Final = frozenset({"_failureIf", "_successIf", "_skipIf", "_while"})


@dataclass(frozen=True, slots=True)
class Attributes:
    """An element's attributes, sorted.

    Attributes:
        name: The instance name, empty if none is given.
        ports: The texts of ports or, for a sub-tree, of the keys to connect.
        conditions: The scripts of condition attributes.
        other: Attributes that start with ``_`` and mean nothing here.
        warnings: Attributes that look like a misspelt condition.
    """

    name: str
    ports: dict[str, str]
    conditions: dict[str, str]
    other: dict[str, str]
    warnings: list[str]


def sort_attributes(element: Element, manifest: NodeManifest) -> Attributes:
    """Sort the attributes of an element.

    Raises:
        LoadError: An attribute belongs to no port of the node type, or the instance name is ill-formed.
    """
    sorted_ = Attributes(element.attributes.get("name", ""), {}, {}, {}, [])
    if has_control_character(sorted_.name):
        raise element.error(f"the name {sorted_.name!r} has a control character")
    for key, text in element.attributes.items():
        if key in ("name", "ID"):
            continue
        if key in _FIELDS:
            sorted_.conditions[key] = text
        elif key.startswith("_"):
            sorted_.other[key] = text
            meant = "" if key in _KNOWN or len(key) > _LONGEST_MISSPELT else _meant(key)
            if meant:
                sorted_.warnings.append(f"{element.place}: is {key} meant as {meant}?")
            if key == "__shared_blackboard":
                sorted_.warnings.append(f"{element.place}: {key} is of version 3 and ignored; use _autoremap")
        elif key in manifest.ports or manifest.kind is NodeKind.SUBTREE:
            sorted_.ports[key] = text
        else:
            ports = ", ".join(manifest.ports) or "none"
            raise element.error(f"{manifest.type_id} has no port '{key}'; its ports: {ports}")
    return sorted_


@lru_cache(1000)
def _meant(key: str) -> str:
    """Return the attribute that a similar one may be meant as, empty if there is none; a tree has many of one name."""
    similar = get_close_matches(key, _KNOWN, n=1, cutoff=0.7)
    return similar[0] if similar else ""


def compile_conditions(
    element: Element, scripts: Mapping[str, str], board: Blackboard, runtime: Runtime
) -> Conditions | None:
    """Compile the scripts of an element's condition attributes; return None if it has none.

    Raises:
        LoadError: A script is not well-formed.
    """
    if not scripts:
        return None
    compiled: dict[str, Callable[[], Any]] = {}
    for key, text in scripts.items():
        compile_ = compile_condition if key in _ASKED else compile_script
        try:
            compiled[_FIELDS[key]] = compile_(text, board, runtime.enums, extensions=runtime.extensions)
        except ScriptError as error:
            raise element.error(f"{key}: {error.message}") from error
    return Conditions(**compiled)
