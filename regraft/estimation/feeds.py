"""The feeds of an architecture: which component feeds which input, in which order, and which of them are in a cycle."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.lifecycle import State

Feeders = dict[str, tuple[str, ...]]
"""The components that feed a component, by input port."""


@dataclass(frozen=True, slots=True)
class Ends:
    """The topics that a component's estimator reads the writers of, by port, and those that the component writes."""

    reads: tuple[tuple[str, str], ...]
    writes: frozenset[str]


@dataclass(frozen=True, slots=True)
class Feeds:
    """Components in an order in which each comes behind all that feed it, cycles apart, and what feeds them.

    ``cycle`` has the number of each component's cycle; one that is in none has a number of its own.
    """

    order: tuple[str, ...]
    feeders: dict[str, Feeders]
    cycle: dict[str, int]

    def is_cyclic(self, feeder: str, component: str) -> bool:
        """Return whether the feeder is fed, directly or not, by the component that it feeds."""
        return self.cycle[feeder] == self.cycle[component]


def ends_of(spec: ComponentSpec) -> Ends:
    """Return the topics of a component's ports; one that is not active reads and writes none.

    An estimator that does not depend on inputs closes no cycle, with any inputs of its component.
    """
    if spec.state is not State.ACTIVE or spec.description is None:
        return Ends((), frozenset())
    reads, writes = [], []
    for port, topic in spec.connected_ports():
        if port.direction == "input":
            if spec.description.estimates_from_inputs:
                reads.append((port.name, topic))
        else:
            writes.append(topic)
    return Ends(tuple(reads), frozenset(writes))


def feeds_of(ends: Mapping[str, Ends]) -> Feeds:
    """Return the feeds between components with these ends."""
    writers: dict[str, list[str]] = {}
    for name in sorted(ends):
        for topic in ends[name].writes:
            writers.setdefault(topic, []).append(name)
    feeders = {name: {port: tuple(writers.get(topic, ())) for port, topic in ends[name].reads} for name in sorted(ends)}
    cycles = list(_cycles({name: sorted({n for f in ports.values() for n in f}) for name, ports in feeders.items()}))
    order = tuple(name for members in cycles for name in sorted(members))
    return Feeds(order, feeders, {name: number for number, members in enumerate(cycles) for name in members})


def _cycles(needs: Mapping[str, list[str]]) -> Iterator[list[str]]:
    """Yield the strongly connected components, each behind those that it needs (Tarjan 1972, without recursion)."""
    index: dict[str, int] = {}
    lowest: dict[str, int] = {}
    stack: list[str] = []
    waiting: set[str] = set()
    for start in needs:
        if start in index:
            continue
        path = [(start, iter(needs[start]))]
        index[start] = lowest[start] = len(index)
        stack.append(start)
        waiting.add(start)
        while path:
            name, left = path[-1]
            for other in left:
                if other not in index:
                    index[other] = lowest[other] = len(index)
                    stack.append(other)
                    waiting.add(other)
                    path.append((other, iter(needs[other])))
                    break
                if other in waiting:
                    lowest[name] = min(lowest[name], index[other])
            else:
                path.pop()
                if path:
                    lowest[path[-1][0]] = min(lowest[path[-1][0]], lowest[name])
                if lowest[name] == index[name]:
                    members = stack[stack.index(name) :]
                    del stack[stack.index(name) :]
                    waiting.difference_update(members)
                    yield members
