"""The patrol as processes: breaks and mends its components, and compares what really runs with the realizations."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from regraft import CallFailed
from regraft.bus_schema.messages.management.objectives import (
    Objective,
    ObjectivesQuery,
    ObjectivesRequest,
    ObjectivesStatus,
    ObjectiveStatus,
)
from regraft.bus_schema.messages.protocol.control import ComponentView
from regraft.client import ClientError
from tests.metacontrol.patrol.parts import Condition, Measured
from tests.metacontrol.patrol.stacks import PATROL, write
from tests.support.systems import System
from tests.support.waiting import PATIENCE, wait_until

SKILL = "to_navigate"
REST = "__DEFAULT__"
OBJECTIVE = Objective(SKILL, "patrol", {"safety": 0.5, "energy": 0.5})
METACONTROL = "planners/metacontrol/objectives"


class Patrol(System):
    """A patrol under the real clock."""

    def __init__(self, folder: Path, *, for_good: str = "") -> None:
        """Start it; the component ``for_good`` is not restarted when it ends."""
        super().__init__(write(folder, simulated=False, for_good=for_good))
        parts = yaml.safe_load((folder / "system_modes.yaml").read_text())
        self._parts: dict[str, Any] = {name: part["ros__parameters"]["modes"] for name, part in parts.items()}

    def put(self, **components: bool) -> None:
        """Mend components (true), or break them."""
        for name, well in components.items():
            self.client.call("workshop/set", Condition(name, well), Condition, PATIENCE)

    def measure(self, safety: float = -1.0, energy: float = -1.0) -> None:
        """Have other qualities measured from now on."""
        self.client.call("workshop/measure", Measured(safety, energy), Measured, PATIENCE)

    def add(self, objective: Objective = OBJECTIVE) -> ObjectiveStatus:
        """Give an objective."""
        request = ObjectivesRequest((objective,), "tester")
        return self.client.call(f"{METACONTROL}/add", request, ObjectivesStatus, PATIENCE).objectives[0]

    def status(self) -> ObjectiveStatus | None:
        """Return the status of the objective, None where the metacontroller does not answer."""
        try:
            found = self.client.call(f"{METACONTROL}/list", ObjectivesQuery("patrol"), ObjectivesStatus, PATIENCE)
        except CallFailed:
            return None
        return found.objectives[0]

    def wait_for_realization(self, name: str) -> None:
        """Wait until the objective has a realization, and until just this one really runs."""
        wait_until(lambda: (known := self.status()) and known.realization == name, f"the realization {name!r}")
        wait_until(lambda: self.really() == {name or REST}, f"{name or REST} to run")

    def really(self) -> set[str]:
        """Return the realizations whose states and values are those of the processes now."""
        views = {name: self.view(name) for name in PATROL}
        return {mode for mode in self._parts[SKILL] if self._is(mode, views)}

    def view(self, name: str) -> ComponentView | None:
        """Return what a component itself reports, None while it cannot."""
        try:
            return self.client.view(name)
        except ClientError:
            return None

    def _is(self, mode: str, views: dict[str, ComponentView | None]) -> bool:
        states = self._parts[SKILL][REST] | self._parts[SKILL][mode]
        return all(self._fits(name, states[name], views[name]) for name in PATROL)

    def _fits(self, name: str, wanted: str, view: ComponentView | None) -> bool:
        state, _, mode = wanted.partition(".")
        if view is None or state != "active":
            return view is None or view.state.value != "active"
        own = self._parts.get(name, {REST: {"ros__parameters": {}}})
        values = own[REST]["ros__parameters"] | own[mode or REST]["ros__parameters"]
        return view.state.value == "active" and all(view.parameters[key] == value for key, value in values.items())
