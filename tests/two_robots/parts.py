"""A component that joins a running robot."""

from __future__ import annotations

from regraft import Component, service
from regraft.bus_schema.messages.mission import MissionRequest, MissionStatus


class Curious(Component):
    """Passes on what the executor of its robot says."""

    lockstep = False

    @service("curious")
    async def ask(self, request: MissionRequest) -> MissionStatus:
        return await self.kit.call("mission/status", request, MissionStatus)
