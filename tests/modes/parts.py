"""A laser that fails by itself and recovers, those that depend on it, and one that sums all up."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from regraft import Component, Input, Output, Parameter, Quality, every, service
from regraft.bus_schema.annotations import Count
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.messages.evaluation import RunSummary, RunSummaryRequest
from regraft.bus_schema.messages.management.system import SystemFaults, SystemStates
from regraft.bus_schema.model.adaptation import AdaptationReport, EnterMode
from regraft.lockstep.source import TimeSource
from tests.support.machine.processes import kill

FAILS_AFTER = 1.0
RECOVERS_AFTER = 1.5


@message("modes/Sample")
@dataclass(frozen=True, slots=True)
class Sample:
    """The ``n``-th value."""

    stamp: float
    n: Count


class World(TimeSource):
    """Counts ticks."""

    ticks = Output(Sample)

    def advance(self, tick: int, seconds: float) -> None:
        self.ticks.publish(Sample(self.kit.now(), tick))


class Beacon(Component):
    """Publishes where there is no world."""

    ticks = Output(Sample)

    def __init__(self) -> None:
        self.n = 0

    @every(hz=20)
    def shine(self) -> None:
        self.n += 1
        self.ticks.publish(Sample(self.kit.now(), self.n))


class Killer(Component):
    """Kills whom a file names as it comes to a step, once; ``strike`` is called at each step, for tests in memory."""

    strike: ClassVar[Callable[[str], object]] = staticmethod(lambda step: None)
    kills = Parameter("", "the file with the step, and the process that is killed then", unit="path", read_only=True)

    def at(self, step: str) -> None:
        type(self).strike(step)
        file = Path(self.kills) if self.kills else None
        if file is None or not file.exists():
            return
        wanted, _, pid = file.read_text().rpartition(" ")
        if wanted == step:
            file.unlink()
            kill(int(pid))

    def on_configure(self) -> None:
        self.at(f"{self.kit.name} configure")

    def on_activate(self) -> None:
        self.at(f"{self.kit.name} activate")

    def on_deactivate(self) -> None:
        self.at(f"{self.kit.name} deactivate")


def _no_air() -> Any:
    raise RuntimeError("no air")


NONSENSE: dict[str, Callable[[], Any]] = {
    "nan": lambda: {"clearness": float("nan")},
    "inf": lambda: {"clearness": float("inf")},
    "minus inf": lambda: {"clearness": float("-inf")},
    "text": lambda: {"clearness": "0.1"},
    "truth": lambda: {"clearness": False},
    "percent": lambda: {"clearness": 30.0},
    "negative": lambda: {"clearness": -0.1},
    "nothing": dict,
    "raises": _no_air,
    "no map": lambda: 0.1,
}
"""Values that a component may give, and that are no quality."""


class Laser(Killer):
    """Fails by itself a while after its first activations, and has recovered a while later."""

    scans = Output(Sample)
    fails_after = Parameter(FAILS_AFTER, "time from an activation to its failure", minimum=0.0, unit="s")
    recovers_after = Parameter(RECOVERS_AFTER, "time until it has recovered", minimum=0.0, unit="s")
    failures = Parameter(2, "how often it fails at all", minimum=0)
    rate = Parameter(5.0, minimum=0.1, maximum=50.0, unit="Hz")

    clearness = Quality("of the air", minimum=0.0, maximum=1.0, better="higher", estimated=False)
    evaluate_every = 0.2
    air = Parameter(1.0, "how clear it is")
    nonsense = Parameter("", "the kind of nonsense that is measured", choices=("", *NONSENSE))

    def __init__(self) -> None:
        self.n = 0
        self.failed = 0

    def on_activate(self) -> None:
        super().on_activate()
        if self.failed < self.failures:
            self.kit.spawn(self.break_down(), "breaking down")

    async def break_down(self) -> None:
        await self.kit.sleep(self.fails_after)
        self.failed += 1
        self.kit.fail("the mirror is stuck")
        await self.kit.sleep(0.0)

    def on_error(self) -> None:
        self.kit.spawn(self.mend(), "mending")

    async def mend(self) -> None:
        await self.kit.sleep(self.recovers_after)
        self.kit.recovered()

    @every(hz=10)
    def scan(self) -> None:
        self.n += 1
        self.scans.publish(Sample(self.kit.now(), self.n))

    def evaluate(self) -> dict[str, float]:
        return NONSENSE[self.nonsense]() if self.nonsense else {"clearness": self.air}


class Driver(Killer):
    """Drives by the laser, slower without it."""

    scans = Input(Sample, latest_only=True, required=False)
    speed = Parameter(1.0, minimum=0.0, maximum=2.0, unit="m/s")
    careful = Parameter(False)

    def on_parameters(self, changed: frozenset[str]) -> None:
        self.at(f"{self.kit.name} set")


class Lamp(Killer):
    """Warns others."""


class Summary(Component):
    """Sums up all that it reads."""

    ticks = Input(Sample, keep=10_000)
    scans = Input(Sample, keep=10_000, required=False)
    adaptations = Input(AdaptationReport, keep=1000)
    faults = Input(SystemFaults, topic="system/faults", keep=1000)
    states = Input(SystemStates, topic="system/states", keep=1000)

    def __init__(self) -> None:
        self.chain = hashlib.sha256()
        self.counts: dict[str, int] = {}

    @every(seconds=0.25)
    def absorb(self) -> None:
        for name, port in (
            ("tick", self.ticks),
            ("scan", self.scans),
            ("faults", self.faults),
            ("states", self.states),
        ):
            for sample in port.take():
                self._note(codec.encode(sample), name)
        for report in self.adaptations.take():
            entered = ",".join(each.mode for each in report.request.changes if isinstance(each, EnterMode))
            self._note(f"{report.tick}{report.outcome}{report.revision_after}".encode(), f"{entered} {report.tick}")

    def _note(self, payload: bytes, what: str) -> None:
        self.chain.update(payload + what.encode())
        self.counts[what] = self.counts.get(what, 0) + 1

    @service("run_summary")
    def run_summary(self, request: RunSummaryRequest) -> RunSummary:
        self.absorb()
        counts = dict(sorted(self.counts.items()))
        return RunSummary(self.kit.now(), self.chain.hexdigest(), 0, 0, 0.0, counts, {}, {}, {})
