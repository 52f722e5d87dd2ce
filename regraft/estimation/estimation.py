"""The qualities of a whole architecture, estimated from its classes and connections; of its neighbours at little cost.

Nothing has to run. Each estimator is given the qualities of what feeds its inputs, by port. An input within a cycle has
what was measured last; figures that rest on it are called assumed.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.estimates import Figure, Source
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.qualities import ONLY_MEASURED
from regraft.estimation.calling import Call, call
from regraft.estimation.feeds import Feeders, ends_of, feeds_of

Values = Mapping[str, float]
NOTHING: Values = MappingProxyType({})
Specs = Mapping[str, ComponentSpec]


class _Inputs(Mapping[str, Values]):
    """The qualities of what feeds a component, by port; it notes which ports were read."""

    __slots__ = ("_fed", "read")

    def __init__(self, fed: Mapping[str, Values]) -> None:
        self._fed = fed
        self.read: set[str] = set()

    def __getitem__(self, port: str) -> Values:
        self.read.add(port)
        return self._fed[port]

    def __iter__(self) -> Iterator[str]:
        self.read.update(self._fed)
        return iter(self._fed)

    def __len__(self) -> int:
        self.read.update(self._fed)
        return len(self._fed)


@dataclass(frozen=True, slots=True)
class _Estimated:
    """One component: its figures, the values among them, and those of the ports that its estimator has read.

    ``assumptions`` are the feeds of a cycle that the figures rest on.
    """

    spec: ComponentSpec
    figures: Mapping[str, Figure]
    values: Values = field(default_factory=dict)
    read: Mapping[str, Values] = field(default_factory=dict)
    assumptions: tuple[str, ...] = ()


class Estimation:
    """The estimated qualities of one architecture's components, in one context."""

    def __init__(
        self,
        components: Specs,
        context: Mapping[str, PlainValue] | None = None,
        measured: Mapping[str, Values] | None = None,
        call: Call = call,
    ) -> None:
        """Estimate all ``components``; ``measured`` is what those measured last that run.

        ``call`` asks one class: by default in this process.
        """
        self._context = dict(context or {})
        self._measured = measured or {}
        self._call = call
        self._ends = {name: ends_of(spec) for name, spec in components.items()}
        self._feeds = feeds_of(self._ends)
        self._found: dict[str, _Estimated] = {}
        for name in self._feeds.order:
            self._found[name] = self._estimate(components[name], self._found, as_measured=True)

    @property
    def figures(self) -> dict[str, Mapping[str, Figure]]:
        """The figure of each quality that a component declares, by component and quality."""
        return {name: self._found[name].figures for name in sorted(self._found)}

    def figure(self, component: str, quality: str) -> Figure:
        """Return one figure; it is unknown where there is no such component or quality."""
        found = self._found.get(component)
        missing = Figure(None, Source.UNKNOWN, "not declared" if found else "the component is not there")
        return found.figures.get(quality, missing) if found else missing

    def changed(self, components: Specs) -> Estimation:
        """Return the estimation of another architecture; what it shares with this one is not estimated again.

        A spec is shared if it is equal, fastest if it is the same object. Measurements of a changed component count no
        longer.
        """
        other = object.__new__(Estimation)
        other._context, other._measured, other._call = self._context, self._measured, self._call
        fresh = {name for name, spec in components.items() if not self._knows(name, spec)}
        if fresh or len(components) != len(self._found):
            ends = {name: ends_of(components[name]) if name in fresh else self._ends[name] for name in components}
            other._ends, other._feeds = (self._ends, self._feeds) if ends == self._ends else (ends, feeds_of(ends))
        else:
            other._ends, other._feeds = self._ends, self._feeds
        found: dict[str, _Estimated] = {}
        for name in other._feeds.order:
            before = self._found.get(name)
            if before is not None and name not in fresh and other._reads_the_same(name, before, found):
                found[name] = before
            else:
                found[name] = other._estimate(components[name], found, as_measured=False)
        other._found = found
        return other

    def _knows(self, name: str, spec: ComponentSpec) -> bool:
        before = self._found.get(name)
        return before is not None and (before.spec is spec or before.spec == spec)

    def _reads_the_same(self, name: str, before: _Estimated, found: Mapping[str, _Estimated]) -> bool:
        """Return whether all that its estimator has read is as before: most have read nothing."""
        if not before.read:
            return True
        feeders = self._feeds.feeders[name]
        fed, assumptions = self._fed(name, {port: feeders.get(port, ()) for port in before.read}, found)
        return fed == before.read and _of(assumptions, before.read) == before.assumptions

    def _estimate(self, spec: ComponentSpec, found: Mapping[str, _Estimated], *, as_measured: bool) -> _Estimated:
        if spec.description is None:
            return _Estimated(spec, {})
        described = spec.description.qualities
        if spec.state is not State.ACTIVE:
            why = f"the component is {spec.state.value}"
            return _Estimated(spec, {quality.name: Figure(None, Source.UNKNOWN, why) for quality in described})
        if not described:
            return _Estimated(spec, {})
        fed, assumptions = self._fed(spec.name, self._feeds.feeders[spec.name], found)
        inputs = _Inputs(fed)
        judged = self._call(spec, self._context, inputs)
        assumed = _of(assumptions, inputs.read)
        estimated = Figure(None, Source.ESTIMATED)
        if assumed:
            estimated = Figure(None, Source.ASSUMED, f"in a cycle, by what was measured last: {', '.join(assumed)}")
        measured = self._measured.get(spec.name, NOTHING) if as_measured else NOTHING
        figures = {}
        for quality in described:
            name = quality.name
            if name in judged.values:
                figures[name] = Figure(judged.values[name], estimated.source, estimated.why)
            elif name in measured and quality.measured:
                figures[name] = Figure(measured[name], Source.MEASURED)
            else:
                why = judged.unknown.get(name, "") if quality.estimated else ONLY_MEASURED
                figures[name] = Figure(None, Source.UNKNOWN, why)
        values = {name: figure.value for name, figure in figures.items() if figure.value is not None}
        return _Estimated(spec, figures, values, {port: fed.get(port, NOTHING) for port in inputs.read}, assumed)

    def _fed(
        self, name: str, feeders: Feeders, found: Mapping[str, _Estimated]
    ) -> tuple[dict[str, Values], dict[str, tuple[str, ...]]]:
        """Return the qualities of what feeds each port, and what of it is assumed.

        Where several feed one port, names that more than one of them gives are left out.
        """
        fed: dict[str, Values] = {}
        assumptions: dict[str, tuple[str, ...]] = {}
        for port, names in feeders.items():
            given = []
            for feeder in names:
                if self._feeds.is_cyclic(feeder, name):
                    assumptions[port] = (*assumptions.get(port, ()), f"{name}.{port} from {feeder}")
                    given.append(self._measured.get(feeder, NOTHING))
                else:
                    assumptions[port] = (*assumptions.get(port, ()), *found[feeder].assumptions)
                    given.append(found[feeder].values)
            fed[port] = given[0] if len(given) == 1 else _unambiguous(given)
        return fed, assumptions


def _unambiguous(given: list[Values]) -> Values:
    names = [name for values in given for name in values]
    return {name: value for values in given for name, value in values.items() if names.count(name) == 1}


def _of(assumptions: Mapping[str, tuple[str, ...]], ports: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(text for port in sorted(ports) for text in assumptions.get(port, ())))
