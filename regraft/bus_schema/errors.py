"""The errors of the schema.

SchemaError
├── BadMessage    bytes or values that do not fit the type they claim to be
│   └── BadCombination  fields that do not fit each other
├── BadKey        a name or key expression that is not well formed
└── BadType       a message class that cannot be described
"""

from __future__ import annotations


class SchemaError(ValueError):
    """Anything wrong with what travels on the bus."""


class BadMessage(SchemaError):
    """A value that does not fit its type; ``where`` is the path of the field at fault, ``why`` what is wrong."""

    def __init__(self, why: str, where: tuple[str, ...] = ()) -> None:
        self.why = why
        self.where = where
        super().__init__(f"{'.'.join(where)}: {why}" if where else why)

    def inside(self, field: str) -> BadMessage:
        """Return the same error, seen from the record that holds ``field``."""
        return type(self)(self.why, (field, *self.where))


class BadCombination(BadMessage):
    """Fields that fit their types one by one, but not each other, or whose text means nothing."""


class BadKey(SchemaError):
    """A system, component, topic or service name that cannot be part of a key expression."""


class BadType(SchemaError):
    """A class that cannot be a message."""
