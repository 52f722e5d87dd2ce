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
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.qualities.estimates import Figure, Source
from regraft.bus_schema.model.qualities.qualities import NOT_GIVEN, ONLY_MEASURED, Judged, QualityDescription
from regraft.estimation.calling import Call, call
from regraft.estimation.feeds import Ends, Feeders, Feeds, ends_of, feeds_of

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
        *,
        former: Estimation | None = None,
    ) -> None:
        """Estimate all ``components``; ``measured`` is what those measured last that run.

        ``call`` asks one class: by default in this process. `changed` gives the ``former`` estimation.
        """
        self._context = dict(context or {})
        self._measured = measured or {}
        self._call = call
        known = former._found if former is not None else {}
        fresh = {name for name, spec in components.items() if not _is_known(known.get(name), spec)}
        self._ends, self._feeds = self._wired(components, fresh, former)
        self._found: dict[str, _Estimated] = {}
        for name in self._feeds.order:
            if name in fresh or not self._reads_the_same(name, known[name]):
                self._found[name] = self._estimate(components[name], as_measured=former is None)
            else:
                self._found[name] = known[name]

    def changed(self, components: Specs) -> Estimation:
        """Return the estimation of another architecture; what it shares with this one is not estimated again.

        A spec is shared if it is equal, fastest if it is the same object. Measurements of a changed component count no
        longer.
        """
        return Estimation(components, self._context, self._measured, self._call, former=self)

    @property
    def figures(self) -> dict[str, Mapping[str, Figure]]:
        """The figure of each quality that a component declares, by component and quality."""
        return {name: self._found[name].figures for name in sorted(self._found)}

    def figure(self, component: str, quality: str) -> Figure:
        """Return one figure; it is unknown where there is no such component or quality."""
        found = self._found.get(component)
        missing = Figure(None, Source.UNKNOWN, "not declared" if found else "the component is not there")
        return found.figures.get(quality, missing) if found else missing

    @staticmethod
    def _wired(components: Specs, fresh: set[str], former: Estimation | None) -> tuple[dict[str, Ends], Feeds]:
        """Return the ends of all components and the feeds between them, the former ones where they still hold."""
        if former is None:
            ends = {name: ends_of(spec) for name, spec in components.items()}
            return ends, feeds_of(ends)
        ends = {name: ends_of(components[name]) if name in fresh else former._ends[name] for name in components}
        return (former._ends, former._feeds) if ends == former._ends else (ends, feeds_of(ends))

    def _reads_the_same(self, name: str, before: _Estimated) -> bool:
        """Return whether all that its estimator has read is as before: most have read nothing."""
        if not before.read:
            return True
        feeders = self._feeds.feeders[name]
        fed, assumptions = self._fed(name, {port: feeders.get(port, ()) for port in before.read})
        return fed == before.read and _of(assumptions, before.read) == before.assumptions

    def _estimate(self, spec: ComponentSpec, *, as_measured: bool) -> _Estimated:
        described = spec.description.qualities if spec.description is not None else ()
        if not described:
            return _Estimated(spec, {})
        if spec.state is not State.ACTIVE:
            why = f"the component is {spec.state.value}"
            return _Estimated(spec, {quality.name: Figure(None, Source.UNKNOWN, why) for quality in described})
        fed, assumptions = self._fed(spec.name, self._feeds.feeders[spec.name])
        inputs = _Inputs(_inputs_of(spec) | fed)
        judged = self._call(spec, self._context, inputs)
        assumed = _of(assumptions, inputs.read)
        measured = self._measured.get(spec.name, NOTHING) if as_measured else NOTHING
        figures = {quality.name: _figure(quality, judged, measured, assumed) for quality in described}
        values = {name: figure.value for name, figure in figures.items() if figure.value is not None}
        return _Estimated(spec, figures, values, {port: fed.get(port, NOTHING) for port in inputs.read}, assumed)

    def _fed(self, name: str, feeders: Feeders) -> tuple[dict[str, Values], dict[str, tuple[str, ...]]]:
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
                    assumptions[port] = (*assumptions.get(port, ()), *self._found[feeder].assumptions)
                    given.append(self._found[feeder].values)
            fed[port] = given[0] if len(given) == 1 else _unambiguous(given)
        return fed, assumptions


def _is_known(before: _Estimated | None, spec: ComponentSpec) -> bool:
    return before is not None and (before.spec is spec or before.spec == spec)


def _inputs_of(spec: ComponentSpec) -> dict[str, Values]:
    """Return nothing for each input of a component whose estimator reads them."""
    if spec.description is None or not spec.description.estimates_from_inputs:
        return {}
    return {port.name: NOTHING for port in spec.description.ports if port.direction == "input"}


def _figure(quality: QualityDescription, judged: Judged, measured: Values, assumed: tuple[str, ...]) -> Figure:
    name = quality.name
    if name in judged.values and assumed:
        why = f"in a cycle, by what was measured last: {', '.join(assumed)}"
        return Figure(judged.values[name], Source.ASSUMED, why)
    if name in judged.values:
        return Figure(judged.values[name], Source.ESTIMATED)
    if name in measured and quality.measured:
        return Figure(measured[name], Source.MEASURED)
    why = judged.unknown.get(name, NOT_GIVEN) if quality.estimated else ONLY_MEASURED
    return Figure(None, Source.UNKNOWN, why)


def _unambiguous(given: list[Values]) -> Values:
    names = [name for values in given for name in values]
    return {name: value for values in given for name, value in values.items() if names.count(name) == 1}


def _of(assumptions: Mapping[str, tuple[str, ...]], ports: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(text for port in sorted(ports) for text in assumptions.get(port, ())))
