"""An objective over slots: what each combination is worth, by an expression over context, figures and estimates.

The names of an expression are looked for in this order:

- a quality that is measured, as long as what it depends on stands; else its estimate
- an estimate of a component: ``navigator.power``
- an assumption
- a slot: the name of its alternative, where one is chosen
- a figure of a slot's alternatives, added up where several are chosen: ``camera.power``
- the context

``total.power`` is the sum of a figure over all slots.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any, Final

import numpy as np

from regraft.adaptation_manager.planners.choices.decomposition import inlined, summands
from regraft.adaptation_manager.planners.choices.estimates import Estimator
from regraft.adaptation_manager.planners.choices.problem import UNKNOWN, Term
from regraft.adaptation_manager.planners.choices.slots import Slot
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.expressions import Expression, Unknown

MAX_EVALUATIONS: Final = 50_000
"""Combinations for which one summand is worked out."""
AS_WRITTEN: Final = 300
"""Combinations up to which an objective is worked out as it is written, and not taken apart."""
TOTAL: Final = "total"


@dataclass(frozen=True, slots=True)
class Objective:
    """An expression that is to be greatest: ``utility``.

    ``assume`` are expressions that become the context of the estimates, in their order. ``named`` are expressions that
    others may speak of by name.
    """

    utility: Expression
    assume: tuple[tuple[str, Expression], ...] = ()
    named: dict[str, Expression] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class MeasuredValue:
    """A quality as it is measured of what stands: the selection in force of each slot, None where there is none.

    It holds where nothing changes that it depends on: neither ``slots`` nor those of its estimate. Else the estimate
    counts, if there is one.
    """

    value: float
    standing: tuple[int | None, ...]
    slots: frozenset[int] = frozenset()
    estimated: Expression | None = None


class Evaluation:
    """An objective under one context: works expressions out for combinations of some slots' selections."""

    def __init__(
        self,
        slots: Sequence[Slot],
        objective: Objective,
        context: Mapping[str, Any],
        estimator: Estimator,
        measured: Mapping[str, MeasuredValue] | None = None,
    ) -> None:
        self.slots = slots
        self.objective = objective
        self.estimator = estimator
        self.context = context
        self.unknown: dict[str, None] = {}
        self._index = {slot.name: index for index, slot in enumerate(slots)}
        self.measured = dict(measured or {})
        named = {**objective.named, **self._totals()}
        self._named = {name: each for name, each in named.items() if name not in self.measured}
        self.assumed = self._assumptions()
        self._scopes: dict[str, frozenset[int]] = {}
        self._estimated: dict[tuple[Any, ...], Mapping[str, float | Unknown] | Unknown] = {}

    def _assumptions(self) -> dict[str, Expression]:
        """Return the assumptions with what they name put in; an earlier one comes before what else has its name."""
        found: dict[str, Expression] = {}
        for name, expression in self.objective.assume:
            found[name] = _put_in(expression, {each: e for each, e in self._named.items() if each not in found})
        return found

    # --- the objective as terms ---

    def terms(self) -> tuple[Term, ...]:
        """Return the terms whose sum is the utility; raises BadMessage if one ties too much together."""
        utility = self.objective.utility
        whole = self.whole(utility)
        if math.prod(len(self.slots[index].selections) for index in self.scope(whole)) <= AS_WRITTEN:
            return (self._term(whole),)
        return tuple(self._term(part) for part in summands(utility, self._named))

    def whole(self, expression: Expression) -> Expression:
        """Return an expression with what it names put in."""
        return _put_in(expression, self._named)

    def _term(self, expression: Expression) -> Term:
        scope = sorted(self.scope(expression))
        sizes = self._sizes(scope, expression)
        worth = np.empty(sizes)
        for chosen in product(*map(range, sizes)):
            try:
                worth[chosen] = expression.number(Values(self, dict(zip(scope, chosen, strict=True))))
            except Unknown as error:
                self.unknown.setdefault(str(error))
                worth[chosen] = UNKNOWN
        return Term(tuple(scope), worth)

    def truths(self, expression: Expression) -> tuple[tuple[int, ...], np.ndarray[Any, np.dtype[np.bool_]]]:
        """Return the slots that a condition ties together, and where it is true; not where it is unknown."""
        whole = self.whole(expression)
        scope = sorted(self.scope(whole))
        sizes = self._sizes(scope, expression)
        kept = np.zeros(sizes, dtype=bool)
        for chosen in product(*map(range, sizes)):
            try:
                kept[chosen] = bool(whole.value(Values(self, dict(zip(scope, chosen, strict=True)))))
            except Unknown as error:
                self.unknown.setdefault(str(error))
        return tuple(scope), kept

    def value(self, expression: Expression, chosen: Sequence[int]) -> float:
        """Return an expression's value for a combination of all slots, true being 1; raises Unknown."""
        return self.partly(expression, dict(enumerate(chosen)))

    def partly(self, expression: Expression, chosen: Mapping[int, int]) -> float:
        """Return an expression's value where selections of some slots are chosen; raises Unknown."""
        return self.whole(expression).number(Values(self, chosen))

    # --- what is measured ---

    def is_measured(self, name: str, chosen: Mapping[int, int]) -> bool:
        """Return whether a quality has its measured value where selections of some slots are chosen."""
        measured = self.measured.get(name)
        return measured is not None and all(
            measured.standing[index] is not None and chosen.get(index) == measured.standing[index]
            for index in self._scope(name)
        )

    def quality(self, name: str, chosen: Mapping[int, int], values: Mapping[str, Any]) -> Any:
        """Return a measured quality, or its estimate for what does not stand; raises Unknown."""
        measured = self.measured[name]
        if self.is_measured(name, chosen):
            return measured.value
        if measured.estimated is None:
            raise Unknown(f"{name} is only measured, and of what stands alone")
        return self.whole(measured.estimated).value(values)

    def check_measured(self) -> None:
        """Raise BadMessage if measured qualities tie more slots together than their estimates do, and too many."""
        for name in self.measured:
            self._sizes(sorted(self._scope(name)), Expression(name))
        utility = self.whole(self.objective.utility)
        if math.prod(len(self.slots[index].selections) for index in self.scope(utility)) > AS_WRITTEN:
            for part in summands(self.objective.utility, self._named):
                self._sizes(sorted(self.scope(part)), part)

    def _sizes(self, scope: Sequence[int], expression: Expression) -> list[int]:
        sizes = [len(self.slots[index].selections) for index in scope]
        count = math.prod(sizes)
        if count > MAX_EVALUATIONS:
            names = ", ".join(self.slots[index].name for index in scope)
            what = f"{expression.text[:200]!r} ties {names} together, in {count} combinations"
            raise BadMessage(f"{what}: must be at most {MAX_EVALUATIONS}; write a sum of terms that tie fewer")
        return sizes

    # --- which slots an expression depends on ---

    def scope(self, expression: Expression) -> frozenset[int]:
        """Return the slots that an expression's value depends on."""
        return frozenset().union(*(self._scope(name) for name in expression.names))

    def _scope(self, name: str) -> frozenset[int]:
        if name not in self._scopes:
            self._scopes[name] = frozenset()  # an assumption that speaks of itself has the earlier value of its name
            self._scopes[name] = frozenset(self._found(name))
        return self._scopes[name]

    def _found(self, name: str) -> Iterator[int]:
        if name in self.measured:
            yield from self.measured[name].slots
            estimated = self.measured[name].estimated
            yield from self.scope(self.whole(estimated)) if estimated is not None else ()
            return
        if name in self.assumed:
            yield from self.scope(self.assumed[name])
        if name in self._index:
            yield self._index[name]
        owner, _, figure = name.rpartition(".")
        if owner in self._index:
            yield self._index[owner]
        if figure and self.knows(owner):
            yield from (index for index, slot in enumerate(self.slots) if self._concerns(slot, owner))
            for assumed in self.assumed:
                yield from self._scope(assumed)

    def _concerns(self, slot: Slot, component: str) -> bool:
        return any(
            self.estimator.depends_on(component, setting)
            for alternative in slot.alternatives
            for setting in alternative.every_setting
        )

    def knows(self, component: str) -> bool:
        """Return whether there are estimates of a component."""
        return self.estimator.knows(component)

    # --- values of names ---

    def estimates(
        self, component: str, chosen: Mapping[int, int], assumed: Mapping[str, Any]
    ) -> Mapping[str, float | Unknown]:
        """Return a component's estimates where some slots are chosen; raises Unknown."""
        settings = [
            setting
            for index, selection in sorted(chosen.items())
            for setting in self.slots[index].settings(selection)
            if self.estimator.depends_on(component, setting)
        ]
        key = (component, tuple(setting.content for setting in settings), tuple(assumed.items()))
        if key not in self._estimated:
            try:
                self._estimated[key] = self.estimator.estimate(component, settings, assumed)
            except Unknown as error:
                self._estimated[key] = error
        found = self._estimated[key]
        if isinstance(found, Unknown):
            raise Unknown(str(found))
        return found

    def figure(self, name: str, chosen: Mapping[int, int]) -> Any:
        """Return the name of a slot's alternative, or a figure of it; raises KeyError."""
        owner, _, figure = name.rpartition(".")
        index = self._index.get(name, self._index.get(owner))
        if index is None or index not in chosen:
            raise KeyError(name)
        slot, selection = self.slots[index], chosen[index]
        if name in self._index:
            value = slot.values[selection]
            if not isinstance(value, int | float | str):
                raise KeyError(name)
            return value
        alternatives = [slot.alternatives[each] for each in slot.selections[selection]]
        if not any(figure in each.figures for each in slot.alternatives):
            raise KeyError(name)
        found = [each.figures[figure] for each in alternatives if figure in each.figures]
        return found[0] if len(found) == 1 else sum((float(each) for each in found), 0.0)

    def _totals(self) -> dict[str, Expression]:
        owners: dict[str, list[str]] = {}
        for slot in self.slots:
            for figure in dict.fromkeys(name for each in slot.alternatives for name in each.figures):
                owners.setdefault(figure, []).append(slot.name)
        return {f"{TOTAL}.{figure}": Expression(_sum_text(figure, names)) for figure, names in owners.items()}


class Values(Mapping[str, Any]):
    """The values of names where some slots are chosen.

    An assumption that cannot be worked out is unknown, and with it all estimates: any may depend on it.
    """

    def __init__(self, evaluation: Evaluation, chosen: Mapping[int, int]) -> None:
        self._evaluation = evaluation
        self._chosen = chosen
        self._assumed: dict[str, Any] = {}
        self._unknown: dict[str, Unknown] = {}
        for name, expression in evaluation.assumed.items():
            if evaluation.scope(expression) <= chosen.keys():
                try:
                    self._assumed[name] = expression.value(_Plain(self._plain))
                except Unknown as error:
                    self._unknown[name] = error

    def __getitem__(self, name: str) -> Any:
        """Return a value; raises KeyError or Unknown."""
        if name in self._evaluation.measured:
            return self._evaluation.quality(name, self._chosen, self)
        component, _, quality = name.rpartition(".")
        if quality and self._evaluation.knows(component):
            if self._unknown:
                raise next(iter(self._unknown.values()))
            found = self._evaluation.estimates(component, self._chosen, self._assumed)
            value = found.get(quality)
            if isinstance(value, Unknown):
                raise value
            if value is not None:
                return finite(value, name)
        return self._plain(name)

    def _plain(self, name: str) -> Any:
        if name in self._unknown:
            raise self._unknown[name]
        if name in self._assumed:
            return self._assumed[name]
        try:
            return self._evaluation.figure(name, self._chosen)
        except KeyError:
            return finite(self._evaluation.context[name], name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._evaluation.context)

    def __len__(self) -> int:
        return len(self._evaluation.context)


class _Plain(dict[str, Any]):
    """Names as assumptions see them: without estimates."""

    def __init__(self, find: Any) -> None:
        super().__init__()
        self._find = find

    def __missing__(self, name: str) -> Any:
        return self._find(name)


def finite(value: Any, name: str) -> Any:
    """Return a value; raises Unknown for a number that is none, or infinite."""
    if isinstance(value, float) and not math.isfinite(value):
        raise Unknown(f"{name} is {value}, which counts as unknown")
    return value


def _put_in(expression: Expression, named: Mapping[str, Expression]) -> Expression:
    """Return an expression with named ones in the place of their names; raises BadMessage."""
    if not any(name in named for name in expression.names):
        return expression
    return Expression(ast.unparse(inlined(expression, named)))


def _sum_text(figure: str, slots: Sequence[str]) -> str:
    return " + ".join(f"{slot}.{figure}" for slot in slots)
