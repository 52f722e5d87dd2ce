"""A component that reports which message types its process has compiled."""

from __future__ import annotations

from dataclasses import dataclass

from regraft import service
from regraft.bus_schema.encoding.registry import known_types, message
from tests.handover.parts import Ask, Totaller


@message("host_tests/Names")
@dataclass(frozen=True, slots=True)
class Names:
    """Names of message types."""

    names: tuple[str, ...]


class Compiling(Totaller):
    """Adds up, and lists the types of Regraft whose conversions are compiled in its process."""

    @service("compiled")
    def compiled(self, ask: Ask) -> Names:
        compiled = (kind.name for kind in known_types() if {"pack", "unpack"} & vars(kind).keys())
        return Names(tuple(name for name in compiled if name.startswith("regraft/")))
