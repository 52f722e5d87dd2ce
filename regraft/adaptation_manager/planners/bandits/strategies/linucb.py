"""LinUCB with a model for each option: utility as a linear function of the context (Li et al., WWW 2010)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from random import Random
from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray

from regraft.adaptation_manager.planners.bandits.strategies.averages import MAX_KEPT, TRIES_WITHOUT_CREDIT
from regraft.adaptation_manager.planners.bandits.strategy import CannotLearn, Decision, Knobs, Offer, Strategy
from regraft.bus_schema.annotations import Bounds, PlainValue
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.expressions import Expression, Unknown

MAX_FEATURES: Final = 32
LARGEST: Final = 1e6
"""The largest number to learn on: the squares of larger ones leave nothing of the others, and end in infinity."""

Vector = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class LinUcbKnobs(Knobs):
    """``alpha`` widens the bound, ``ridge`` holds the weights back; ``features`` are the context's numbers that count.

    ``computed`` are further numbers of the context, each an expression over those that were given. Without
    ``features`` all numbers count. They should be of the order of 1.
    """

    alpha: Annotated[float, Bounds(0.0, 100.0)] = 1.0
    ridge: Annotated[float, Bounds(1e-6, 1e6)] = 1.0
    features: tuple[str, ...] = ()
    computed: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        Knobs.__post_init__(self)
        if len(self.computed) > MAX_FEATURES:
            raise BadMessage(f"are {len(self.computed)}, must be at most {MAX_FEATURES}", ("computed",))
        for name, text in self.computed.items():
            try:
                _expression(text)
            except BadMessage as error:
                raise error.inside(name).inside("computed") from None


@dataclass(slots=True)
class Model:
    """The sums of x x' and of u x over an option's credits (in the paper: A without the ridge, b)."""

    products: Vector
    earned: Vector


class LinUcb(Strategy[LinUcbKnobs]):
    """Estimates each option's utility in the present context, and chooses the highest upper bound.

    The context is x = (1, numbers). A number that a context lacks counts as 0, so that others may come and go.
    """

    name = "linucb"
    knobs_class = LinUcbKnobs

    def __init__(self, knobs: LinUcbKnobs) -> None:
        super().__init__(knobs)
        self._names: tuple[str, ...] = ()
        self._models: dict[str, Model] = {}

    def relevant(self, context: Mapping[str, float]) -> dict[str, float]:
        """Return the numbers that count, without computed ones that are unknown."""
        numbers = {**context, **self._computed(context)}
        return {name: numbers[name] for name in self._counting(numbers)}

    def check(self, offer: Offer) -> None:
        """Refuse features that the context lacks, and more numbers than can be learned on."""
        missing = [name for name in self.knobs.features if name not in {*offer.context, *self.knobs.computed}]
        if missing:
            there = ", ".join(sorted(offer.context)) or "none"
            raise BadMessage(f"the context has no number {missing[0]!r}; its numbers: {there}", ("features",))
        relevant = self.relevant(offer.context)
        for name, value in relevant.items():
            if abs(value) > LARGEST:
                raise BadMessage(
                    f"the context's {name!r} is {value:g}, must be within {LARGEST:g}: name those that count",
                    ("features",),
                )
        names = self._names_with(relevant)
        if len(names) > MAX_FEATURES:
            raise BadMessage(f"are {len(names)}, must be at most {MAX_FEATURES}: name those that count", ("features",))

    def choose(self, offer: Offer, rng: Random) -> Decision:
        """Choose the highest x' theta + alpha sqrt(x' A^-1 x) (algorithm 1 of the paper).

        An option chosen often without a credit would keep its wide bound for ever: others go before it.
        """
        names = self._names_with(offer.context)
        x = self._vector(names, offer.context)
        worth = [self._bound(self._models.get(key), x) for key in offer.keys]
        every = range(len(worth))
        hopeful = [index for index in every if not self._is_in_vain(offer.keys[index], offer)] or every
        chosen = max(hopeful, key=worth.__getitem__)
        return Decision(chosen, f"best bound in this context, {worth[chosen]:.4g}")

    def _is_in_vain(self, key: str, offer: Offer) -> bool:
        return key not in self._models and offer.uncredited.get(key, 0) >= TRIES_WITHOUT_CREDIT

    def learn(self, key: str, utility: float, context: Mapping[str, float]) -> None:
        """Take a utility into the option's model."""
        names = self._names_with(context)
        if len(names) > MAX_FEATURES:
            raise CannotLearn(f"there would be {len(names)} numbers to learn on, must be at most {MAX_FEATURES}")
        self._names = names
        x = self._vector(names, context)
        model = _padded(self._models.pop(key, None), len(x))
        self._models[key] = Model(model.products + np.outer(x, x), model.earned + utility * x)
        if len(self._models) > MAX_KEPT:
            del self._models[next(iter(self._models))]

    def _counting(self, context: Mapping[str, float]) -> list[str]:
        return [name for name in sorted(context) if not self.knobs.features or name in self.knobs.features]

    def _computed(self, context: Mapping[str, float]) -> dict[str, float]:
        found = {}
        for name, text in self.knobs.computed.items():
            try:
                value = _expression(text).number(context)
            except Unknown:
                continue
            if math.isfinite(value):
                found[name] = value
        return found

    def _names_with(self, context: Mapping[str, float]) -> tuple[str, ...]:
        return tuple(dict.fromkeys((*self._names, *self._counting(context))))

    def _vector(self, names: tuple[str, ...], context: Mapping[str, float]) -> Vector:
        counting = self._counting(context)
        return np.array([1.0, *(context[name] if name in counting else 0.0 for name in names)])

    def _bound(self, known: Model | None, x: Vector) -> float:
        model = _padded(known, len(x))
        spread = np.linalg.solve(self.knobs.ridge * np.identity(len(x)) + model.products, x)
        return float(spread @ model.earned) + self.knobs.alpha * float(np.sqrt(max(0.0, float(x @ spread))))

    def state(self) -> PlainValue:
        """Return the models."""
        models = {key: [model.products.tolist(), model.earned.tolist()] for key, model in self._models.items()}
        return {"names": list(self._names), "models": models}

    def restore(self, state: PlainValue) -> None:
        """Continue from models."""
        self._names = tuple(state["names"])
        self._models = {key: Model(np.array(a), np.array(b)) for key, (a, b) in state["models"].items()}


def _padded(model: Model | None, size: int) -> Model:
    """Return a model over ``size`` numbers; those that it has not met were 0."""
    grown = Model(np.zeros((size, size)), np.zeros(size))
    if model is not None:
        met = len(model.earned)
        grown.products[:met, :met] = model.products
        grown.earned[:met] = model.earned
    return grown


@lru_cache(maxsize=256)
def _expression(text: str) -> Expression:
    return Expression(text)
