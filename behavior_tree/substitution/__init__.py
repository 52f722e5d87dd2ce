"""Other nodes in place of those that a tree's XML names, by rules."""

from .config import MockConfig
from .nodes import MockAction, MockCondition, MockControl, MockDecorator
from .rules import Substitution, Substitutions

__all__ = [
    "MockAction",
    "MockCondition",
    "MockConfig",
    "MockControl",
    "MockDecorator",
    "Substitution",
    "Substitutions",
]
