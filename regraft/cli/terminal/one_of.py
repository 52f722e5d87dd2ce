"""A word of several that there are."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from typing import TypeVar

import typer

from regraft.bus_schema.suggestions import instead_of

E = TypeVar("E", bound=Enum)


def one_of(members: type[E], what: str) -> Callable[[str], E]:
    """Return a parser of members of an enumeration, typed as their values; for another word it suggests the nearest."""
    known = {str(member.value): member for member in members}

    def parse(text: str) -> E:
        if text not in known:
            raise typer.BadParameter(f"there is no {what} {text!r}; {instead_of(text, known)}")
        return known[text]

    return parse
