"""The strategies by name: ours, those of installed packages, and those named in the planner's parameters."""

from __future__ import annotations

from collections.abc import Iterable
from importlib.metadata import EntryPoint, entry_points
from inspect import getdoc
from typing import Any, Final

from regraft.adaptation_manager.planners.bandits.strategies.epsilon_greedy import EpsilonGreedy
from regraft.adaptation_manager.planners.bandits.strategies.linucb import LinUcb
from regraft.adaptation_manager.planners.bandits.strategies.random_choice import RandomChoice
from regraft.adaptation_manager.planners.bandits.strategies.sliding_window_ucb import SlidingWindowUcb
from regraft.adaptation_manager.planners.bandits.strategies.thompson import Thompson
from regraft.adaptation_manager.planners.bandits.strategies.ucb import Ucb1, UcbTuned
from regraft.adaptation_manager.planners.bandits.strategy import Knobs, Strategy
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding.records import RecordShape, record_shape
from regraft.bus_schema.errors import BadMessage, BadType
from regraft.bus_schema.messages.planning import StrategyDescription
from regraft.bus_schema.suggestions import instead_of
from regraft.process.modules import CannotImport, imported

ENTRY_POINTS: Final = "regraft.strategies"
"""The entry point group of strategies from other packages: each is a class."""

OURS: Final[tuple[type[Strategy[Any]], ...]] = (
    RandomChoice,
    EpsilonGreedy,
    Ucb1,
    UcbTuned,
    SlidingWindowUcb,
    Thompson,
    LinUcb,
)


class BadStrategy(ValueError):
    """A class that cannot be a strategy here; the text states where it was found, and why not."""


class Strategies:
    """The strategies that can be asked for."""

    def __init__(self, places: Iterable[str] = (), found: Iterable[EntryPoint] | None = None) -> None:
        """Gather ours, those of entry points (``found``, or what is installed), and those at ``module:Class``.

        Raises:
            BadStrategy: a place leads nowhere or to no strategy, or a name is taken.
        """
        self._classes: dict[str, type[Strategy[Any]]] = {}
        for cls in OURS:
            self._add(cls, cls.__module__)
        installed = entry_points(group=ENTRY_POINTS) if found is None else found
        for place in (*(entry.value for entry in sorted(installed, key=lambda entry: entry.name)), *places):
            self._add(_found_at(place), place)

    def _add(self, cls: Any, place: str) -> None:
        if not (isinstance(cls, type) and issubclass(cls, Strategy)):
            raise BadStrategy(f"{place!r} holds {cls!r}, which is no Strategy")
        name = getattr(cls, "name", "")
        if not isinstance(name, str) or not name:
            raise BadStrategy(f"the strategy at {place!r} has no name: give the class one, name = 'my_strategy'")
        if self._classes.setdefault(name, cls) is not cls:
            raise BadStrategy(f"the strategy at {place!r} is called {name!r}, which is {self._classes[name]!r} already")
        try:
            if not issubclass(cls.knobs_class, Knobs):
                raise BadStrategy(f"the knobs of {place!r} must be a subclass of Knobs")
            _knobs_schema(cls.knobs_class)
        except (BadType, TypeError) as error:
            raise BadStrategy(f"the knobs of {place!r} must be a dataclass with defaults: {error}") from None

    def knobs(self, name: str, given: dict[str, PlainValue]) -> Knobs:
        """Return a strategy's knobs; raises BadMessage for an unknown strategy, knob or value."""
        knobs: Knobs = _inside("knobs", _shape(self._class(name).knobs_class), given)
        return knobs

    def new(self, name: str, knobs: Knobs) -> Strategy[Any]:
        """Return a strategy that knows nothing yet; raises BadMessage for an unknown one."""
        return self._class(name)(knobs)

    def names(self) -> tuple[str, ...]:
        """Return the names of all strategies."""
        return tuple(self._classes)

    def _class(self, name: str) -> type[Strategy[Any]]:
        if name not in self._classes:
            raise BadMessage(f"there is no strategy {name!r}; {instead_of(name, self._classes)}", ("strategy",))
        return self._classes[name]

    def describe(self) -> tuple[StrategyDescription, ...]:
        """Return what can be asked for, with the JSON Schema of the knobs."""
        return tuple(
            StrategyDescription(name, (getdoc(cls) or "").split("\n\n")[0], _knobs_schema(cls.knobs_class))
            for name, cls in self._classes.items()
        )


def _found_at(place: str) -> Any:
    module, _, name = place.partition(":")
    try:
        return getattr(imported(module), name)
    except (CannotImport, AttributeError) as error:
        raise BadStrategy(f"a strategy at {place!r} (must be module:Class): {error}") from error


def _shape(cls: Any) -> RecordShape:
    return record_shape(cls)


def _inside(field: str, shape: RecordShape, plain: dict[str, PlainValue]) -> Any:
    try:
        return shape.unpack(plain)
    except BadMessage as error:
        raise error.inside(field) from None


def _knobs_schema(cls: type[Knobs]) -> dict[str, Any]:
    """Return the JSON Schema of knobs, with their defaults."""
    schema = _shape(cls).json_schema()
    defaults = cls()
    for name, described in schema["properties"].items():
        value = getattr(defaults, name)
        described["default"] = list(value) if isinstance(value, tuple) else value
    return schema
