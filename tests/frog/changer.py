"""Adapts a running system at given times, as a component of it: in every run at the same tick."""

from __future__ import annotations

import json
from pathlib import Path

from regraft import Component, Parameter
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.perception import Detect, Sightings
from regraft.bus_schema.model.adaptation import AdaptationReport, AdaptationRequest


class Changer(Component):
    """Asks for the adaptations of a script, a list of [seconds, changes, service], and each detector that it names."""

    script = Parameter("", "a JSON file", unit="path", read_only=True)

    def on_activate(self) -> None:
        """Begin."""
        self.kit.spawn(self.adapt(), "adapting")

    async def adapt(self) -> None:
        """Ask for one after the other, and print what became of them."""
        for seconds, changes, service in json.loads(Path(self.script).read_text()):
            await self.kit.sleep(seconds - self.kit.now())
            request = codec.from_plain({"changes": changes, "actor": "changer"}, AdaptationRequest)
            report = await self.kit.call("adaptation_manager/adapt", request, AdaptationReport, timeout=60.0)
            print("adaptation", report.outcome.value, report.tick, report.error, report.violations)
            if service:
                seen = await self.kit.call(service, Detect("hydrant", 2), Sightings, timeout=10.0)
                print("seen", self.kit.now(), seen)
