"""The short way through a record ends where the walk along its shapes does, for whatever is given to it."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import pytest

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.compiled import compile_unpack
from regraft.bus_schema.encoding.registry import MessageType
from regraft.bus_schema.errors import BadMessage
from tests.schema.encoding.comparing import same
from tests.schema.encoding.misfits import misfits, places
from tests.schema.every_type import of_every_message

chance = random.Random()


def end_of(convert: Callable[[Any], Any], given: Any) -> Any:
    """Return what becomes of a value, or why nothing does."""
    try:
        return convert(given)
    except BadMessage as error:
        return str(error)


@of_every_message()
def test_both_ways_lead_to_the_same_end(kind: MessageType, message: Any) -> None:
    plain = kind.pack(message)
    assert same(plain, kind.shape.pack(message))
    if kind.tail is None:
        root = {"message": codec.unpack_plain(codec.encode(message))}
        assert same(end_of(kind.unpack, root["message"]), end_of(kind.shape.unpack, root["message"]))
        place = chance.choice(list(places(root, "message", kind.shape)))
        place.holder[place.key] = chance.choice(misfits(place.shape))
        assert same(end_of(kind.unpack, root["message"]), end_of(kind.shape.unpack, root["message"])), root


@dataclass(frozen=True, slots=True)
class Even:
    """Checks itself."""

    number: int

    def __post_init__(self) -> None:
        if self.number % 2:
            raise ValueError(f"is {self.number}, must be even")


@dataclass(frozen=True, slots=True, init=False)
class Doubled:
    """Makes itself."""

    number: int

    def __init__(self, number: int) -> None:
        object.__setattr__(self, "number", 2 * number)


def test_a_record_that_checks_or_makes_itself_is_let_do_so() -> None:
    with pytest.raises(BadMessage, match="must be even"):
        compile_unpack(Even)({"number": 3})
    assert compile_unpack(Doubled)({"number": 3}).number == 6
