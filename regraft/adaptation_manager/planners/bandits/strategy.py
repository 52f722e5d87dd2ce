"""The interface of a strategy: it chooses among options, and learns what they are worth.

A strategy is a class with a name, a dataclass of knobs, and these methods. Another package has an entry point of the
group ``regraft.strategies``, or the planner's parameter ``strategies`` names it as ``module:Class``.

A strategy knows options by their keys, which are equal for equal content: what it has learned holds when the list of
options is reordered, shortened or lengthened. Chance comes to it from outside, so that a run can be repeated.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from random import Random
from typing import ClassVar, Generic, TypeVar

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.errors import BadMessage


@dataclass(frozen=True, slots=True)
class Knobs:
    """The base of all strategies: the range that the utility lies in, from ``low`` to ``high``.

    A strategy learns from utilities scaled to [0, 1] by this range. The range is fixed: utility outside is clipped to
    it. With another range a strategy starts without what it learned.
    """

    low: float = 0.0
    high: float = 1.0

    def __post_init__(self) -> None:
        if not self.low < self.high:
            raise BadMessage(f"is {self.high:g}, must be greater than 'low', which is {self.low:g}", ("high",))
        if not math.isfinite(self.high - self.low):
            raise BadMessage(f"is {self.high:g}, too far from 'low', which is {self.low:g}", ("high",))


K = TypeVar("K", bound=Knobs)


@dataclass(frozen=True, slots=True)
class Offer:
    """The options to choose from: keys in the order given, at least one.

    ``uncredited`` is how often an option was chosen since it last earned a utility. ``context`` holds the numbers
    known of the world that are relevant to the strategy; all of them where it is asked whether it can choose.
    """

    keys: Sequence[str]
    uncredited: Mapping[str, int] = field(default_factory=dict)
    context: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Decision:
    """The index of the option chosen, and why, for people."""

    index: int
    why: str


class CannotLearn(Exception):
    """A utility does not fit what the strategy knows; the text states why."""


class Strategy(ABC, Generic[K]):
    """Chooses among options and learns from the utility that they earn. The first line is shown to people."""

    name: ClassVar[str]
    knobs_class: ClassVar[type[Knobs]] = Knobs

    def __init__(self, knobs: K) -> None:
        """Begin without knowing anything. The knobs may be replaced later: they hold from the next choice on."""
        self.knobs = knobs

    def check(self, offer: Offer) -> None:
        """Refuse knobs that do not fit the options or the context; raises BadMessage."""

    def relevant(self, context: Mapping[str, float]) -> dict[str, float]:
        """Return the numbers of a context that are to be kept with a choice and learned on; none, unless overridden."""
        return {}

    @abstractmethod
    def choose(self, offer: Offer, rng: Random) -> Decision:
        """Choose an option. This does not change what is learned: the choice may be a dry one."""

    @abstractmethod
    def learn(self, key: str, utility: float, context: Mapping[str, float]) -> None:
        """Learn that an option, chosen in a context, earned a utility in [0, 1]; raises CannotLearn."""

    @abstractmethod
    def state(self) -> PlainValue:
        """Return what was learned, as plain data."""

    @abstractmethod
    def restore(self, state: PlainValue) -> None:
        """Continue from what ``state`` returned."""
