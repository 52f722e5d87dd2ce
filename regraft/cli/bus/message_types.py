"""Message types by name, as running components describe them or the schema does: no author's module is imported."""

from __future__ import annotations

from collections.abc import Iterator

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding.registry import known_types, type_named
from regraft.bus_schema.encoding.topic_types import know_schema
from regraft.bus_schema.errors import BadMessage, BadType
from regraft.bus_schema.suggestions import instead_of
from regraft.bus_schema.types_by_schema import DescribedType, describe_type, described_type
from regraft.cli.outcomes import BadInput
from regraft.cli.running_system import Reached
from regraft.client import ClientError


def named(name: str) -> DescribedType:
    """Return a message type that is known here; raises BadInput."""
    know_schema()
    try:
        return described_type(describe_type(type_named(name)))
    except BadType:
        hint = instead_of(name, (kind.name for kind in known_types()))
        raise BadInput(f"the message type {name!r} is not known here; {hint}") from None


def described(there: Reached, name: str, *users: str) -> DescribedType:
    """Return a message type as the first component describes it that knows it; those named ``users`` are asked first.

    Raises:
        BadInput: neither a component nor the schema knows it.
    """
    return next(_told(there, name, users), None) or named(name)


def _told(there: Reached, name: str, users: tuple[str, ...]) -> Iterator[DescribedType]:
    components = there.known.components
    for component in dict.fromkeys((*users, *components)):
        if not components[component].managed:
            continue
        try:
            yield from map(described_type, there.client.types(component, name))
        # A component that is away, or written in another language, may not answer: another one may.
        except (ClientError, BadMessage):
            continue


def packed(kind: DescribedType, body: PlainValue) -> PlainValue:
    """Return what a typed body represents, an absent one for no fields, as it travels; raises BadInput."""
    try:
        return kind.pack({} if body is None else body)
    except BadMessage as error:
        raise misfit(kind, error) from None


def payload(kind: DescribedType, body: PlainValue) -> bytes:
    """Return the payload of a message with a typed body, an absent one for no fields; raises BadInput."""
    try:
        return kind.encode({} if body is None else body)
    except BadMessage as error:
        raise misfit(kind, error) from None


def misfit(kind: DescribedType, error: BadMessage) -> BadInput:
    """Return why a typed body is not of a type."""
    return BadInput(f"the body is no {kind.name}: {error}; see 'regraft types {kind.name}'")
