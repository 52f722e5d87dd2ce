"""Dry runs: other nodes in place of those that a tree's XML names."""

from .config import MockConfig
from .models import mock_models, mock_unknown_types
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
    "mock_models",
    "mock_unknown_types",
]
