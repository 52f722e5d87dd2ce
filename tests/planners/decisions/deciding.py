"""Planners with a small manager, for the tests of decisions."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from regraft.adaptation_manager.planners.bandits.bandit_planner import BanditPlanner
from regraft.adaptation_manager.planners.decisions.deciding import DecidingPlanner
from regraft.adaptation_manager.planners.forecast.forecast_planner import ForecastPlanner
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.management.system import SystemFault, SystemFaultKind, SystemFaults, SystemQualities
from regraft.bus_schema.messages.planning import Proposal, ProposalRequest
from regraft.bus_schema.messages.protocol.control import Snapshot
from regraft.bus_schema.messages.quality import Quality
from regraft.bus_schema.messages.sensors import LightLevel
from regraft.bus_schema.model.adaptation import SetParameters
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.testing import Rig
from tests.planners.parts import SmallManager, spec
from tests.planners.test_forecast import Careful

PLANNERS: dict[str, type[DecidingPlanner]] = {"bandits": BanditPlanner, "forecast": ForecastPlanner}
PACE = """\
context:
  darkness: {topic: light, field: darkness, stale_after: 2}
  safely: {requirement: MoveSafely}
choices:
  pace: {component: navigator, parameter: max_velocity, values: [0.1, 0.18, 0.26]}
qualities:
  speed: {measured: "0.5", estimated: navigator.speed}
  safety: {measured: "1.0 - darkness", estimated: navigator.safety}
objective:
  utility: speed * safety
  assume: {near: "1.0 if darkness > 0.5 else 0.0"}
  settle: 1
faults:
  blind:
    when: darkness > 0.9
    excludes: {pace: [0.18, 0.26]}
"""


class Bench:
    def __init__(self, rig: Rig, manager: SmallManager, name: str) -> None:
        self.rig, self.manager, self.name = rig, manager, name

    def dark(self, darkness: float, seconds: float = 0.1) -> None:
        """Let it be so dark for a while."""
        until = self.rig.clock.now() / 1e9 + seconds
        while self.rig.clock.now() / 1e9 < until:
            self.rig.publish("light", LightLevel(self.rig.clock.now() / 1e9, darkness))
            self.rig.advance(0.1)

    def requires(self, satisfied: bool | None, requirement: str = "MoveSafely") -> None:
        """Let the system say whether it is safe."""
        now = self.rig.clock.now() / 1e9
        quality = Quality(now, requirement, "Safety", satisfied=satisfied)
        self.rig.publish("system/qualities", SystemQualities(now, (quality,)))

    def fails(self, *components: str) -> None:
        """Let the system say that these have failed, and no others."""
        now = self.rig.clock.now() / 1e9
        present = tuple(SystemFault(now, name, 1, SystemFaultKind.DIED) for name in components)
        self.rig.publish("system/faults", SystemFaults(now, present, present))

    def propose(self, apply: bool = True, context: dict[str, Any] | None = None, **inputs: Any) -> Proposal:
        request = ProposalRequest("drive", "pace", "tree", apply, {"decision": "pace", **inputs}, context or {})
        return self.rig.call(f"planners/{self.name}/propose", request, Proposal, timeout=60.0)

    def succeed(self) -> None:
        """Have a further run of the planner take over, with what this one would keep."""
        planner = self._planner
        state = codec.decode(codec.encode(Snapshot(self.name, 1, 0.0, 1, planner.snapshot())), Snapshot).state
        parameters = dict(self.rig.runtimes[self.name].assignment.parameters)
        self.rig.transition(self.name, Transition.DEACTIVATE)
        self.name += "_again"
        successor = self.rig.add(type(planner), self.name, parameters, state=State.INACTIVE)
        successor.restore(state)
        self.rig.transition(self.name, Transition.ACTIVATE)

    @property
    def _planner(self) -> DecidingPlanner:
        component = self.rig.runtimes[self.name].component
        assert isinstance(component, DecidingPlanner)
        return component

    @property
    def reasons(self) -> list[str]:
        return [request.reason for request in self.manager.requests]

    @property
    def paces(self) -> list[Any]:
        changes = [change for request in self.manager.requests for change in request.changes]
        return [change.parameters["max_velocity"] for change in changes if isinstance(change, SetParameters)]


LOST = PACE.replace("  safely:", "  stuck: {fault: wheels}\n  safely:").replace("darkness > 0.9", "stuck")


@contextmanager
def bench(folder: Path, name: str, text: str = PACE) -> Iterator[Bench]:
    (folder / "pace.yaml").write_text(text)
    with Rig() as rig:
        manager = rig.add(SmallManager, "adaptation_manager")
        manager.architecture = manager.architecture.with_component(spec(Careful, "navigator"))
        rig.add(PLANNERS[name], name, {"decisions": str(folder)})
        yield Bench(rig, manager, name)


both = pytest.mark.parametrize("name", PLANNERS)
