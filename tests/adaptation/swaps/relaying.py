"""A source, a totaller that is swapped, and a sink that checks each item; with a manager."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from regraft.bus_schema.model.adaptation import (
    Swap,
)
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec, TopicSpec
from tests.adaptation.parts import Fragile
from tests.adaptation.system import SYSTEM, System, spec_of, started
from tests.handover.parts import Ask, Item, Report, Sink, Source, Totaller
from tests.support.machine.threads import ComponentThread
from tests.support.waiting import PATIENCE, wait_until

ITEM = "handover_tests/Item"
NOTHING = (0, 0, 0, 0)


def class_of(name: str, module: str = "tests.adaptation.swaps.swappable") -> str:
    return f"{module}:{name}"


DOUBLER = Swap("totaller", class_of("Doubler", "tests.handover.parts"))
SERVICES = ("count", "ponder", "configured", "walk", "nap", "hurry")
ANOTHER = ComponentSpec(
    cls=class_of("Totaller", "tests.handover.parts"),
    connections={"totals": "more"},
    services={name: f"another/{name}" for name in SERVICES},
)


def architecture() -> Architecture:
    totaller = spec_of("totaller", Totaller, parameters={"offset": 3})
    wired = {port: topic for port, topic in totaller.connections.items() if port != "config"}
    specs = [
        spec_of("source", Source, parameters={"rate": 500.0}),
        replace(totaller, connections=wired),
        spec_of("sink", Sink),
        spec_of("fragile", Fragile, connections={"heard": "numbers"}),
    ]
    topics = {name: TopicSpec(name, ITEM) for name in ("items", "totals", "others", "more")}
    topics["numbers"] = TopicSpec("numbers", "regraft/Twist")
    return Architecture(SYSTEM, 1, False, {spec.name: spec for spec in specs}, topics)


@contextmanager
def relaying(folder: Path) -> Iterator[System]:
    """Run it all until items are heard."""
    with started(architecture(), folder) as system:
        system.start_manager()
        hears_on(system)
        yield system


def report_of(system: System) -> Report:
    return system.client.call("report", Ask(), Report, PATIENCE)


def hears_on(system: System, count: int = 20) -> None:
    goal = report_of(system).heard + count
    wait_until(lambda: report_of(system).heard >= goal)


def faults(system: System) -> tuple[int, int, int, int]:
    """Return how many items were lost, doubled, disordered and wrong until now."""
    last = system.client.call("say", Ask(), Item, PATIENCE).number
    wait_until(lambda: report_of(system).last >= last)
    report = report_of(system)
    return report.lost, report.doubled, report.disordered, report.wrong


def all_is_well(system: System) -> None:
    hears_on(system)
    assert faults(system) == NOTHING


def runs(system: System) -> list[int]:
    """Return the runs of the totaller that have not ended."""
    return [
        started_as for (name, started_as), run in system.runs.items() if name == "totaller" and run.thread.is_alive()
    ]


def as_before(system: System, run: ComponentThread, views: dict[str, tuple[Any, ...]]) -> None:
    """Check that the same process speaks, with the same values and connections, and that nobody missed anything."""
    assert system.running["totaller"] is run
    after = system.views()
    assert {name: view[1:] for name, view in after.items()} == {name: view[1:] for name, view in views.items()}
    assert {n: v[0] for n, v in after.items() if n != "totaller"} == {
        n: v[0] for n, v in views.items() if n != "totaller"
    }
    assert (len(runs(system)), system.host.beside) == (1, {})
    assert system.host.specs == system.architecture.components
    all_is_well(system)
