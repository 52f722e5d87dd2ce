"""Conditions of adaptations that are to be confirmed, as they are typed."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.adaptation import AdaptationRequest
from regraft.bus_schema.model.watched import Condition
from regraft.cli.outcomes import BadInput
from regraft.cli.terminal.values import document

NAME = re.compile(r"[A-Za-z0-9_.-]+")
"""A text like this is a requirement's name; any other one is an expression."""


@dataclass(frozen=True, slots=True)
class Confirmation:
    """The seconds for which an adaptation is watched before it is final, and what must hold meanwhile."""

    confirm: float = 0.0
    watch: tuple[Condition, ...] = ()

    @classmethod
    def typed(cls, confirm: float | None, watch: Iterable[str] | None) -> Confirmation:
        """Return what the options state; raises BadInput."""
        return cls(confirm or 0.0, tuple(conditions(watch or ())))


def conditions(typed: Iterable[str]) -> Iterator[Condition]:
    """Yield the condition of each text; raises BadInput."""
    for text in typed:
        if text.lstrip()[:1] == "{":
            given = document(text, "--watch")
        else:
            given = text if NAME.fullmatch(text.strip()) else {"require": text}
        try:
            (condition,) = codec.from_plain({"changes": [], "watch": [given]}, AdaptationRequest).watch
        except BadMessage as error:
            where = ".".join(error.where[2:])
            raise BadInput(f"--watch {text!r}: {f'{where}: ' if where else ''}{error.why}") from None
        yield condition
