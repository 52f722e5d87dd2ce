"""The route that follows a mission: changes of its nodes' statuses, and what happens to it, server-sent."""

import asyncio
import threading
from collections.abc import AsyncIterator, Iterator
from typing import Annotated, Any, Final

from fastapi import APIRouter, Depends
from fastapi.sse import EventSourceResponse, ServerSentEvent

from regraft.bus.interface import Closable
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.messages.health import Event
from regraft.bus_schema.messages.mission import MissionTransitions
from regraft.dashboard_api.backend.event_buffer import EventBuffer
from regraft.dashboard_api.backend.manager import Manager, Services
from regraft.dashboard_api.routes.events import LastEventId, declared_stream, stream

TOPIC: Final = "mission/transitions"
"""Where transitions are unless the stack says otherwise."""


class MissionFeed:
    """Listens to the mission while somebody reads: while nobody does, the executor makes no transitions."""

    def __init__(self, services: Services, manager: Manager, buffer: EventBuffer) -> None:
        """Keep what comes in ``buffer``."""
        self.buffer = buffer
        self._client = services.client
        self._manager = manager
        self._lock = threading.Lock()
        self._readers = 0
        self._listening: list[Closable] = []

    def enter(self) -> None:
        """Begin to listen for the first reader; may take a second."""
        with self._lock:
            self._readers += 1
            if self._readers > 1:
                return
            self.buffer.restart()
            self._listening = [
                self._client.topic(self._topic(), MissionTransitions, self._take),
                self._client.events(self._take_event),
            ]

    def leave(self) -> None:
        """Listen no more once the last reader has left."""
        with self._lock:
            self._readers -= 1
            if self._readers == 0:
                for listening in self._listening:
                    listening.close()
                self._listening = []

    def _topic(self) -> str:
        architecture = self._manager.last_architecture()
        topics = architecture.topics.values() if architecture else ()
        return next((topic.name for topic in topics if topic.type == type_of(MissionTransitions).name), TOPIC)

    def _take(self, sample: Any) -> None:
        self.buffer.add_message("transitions", sample.message)

    def _take_event(self, event: Event) -> None:
        if event.kind.startswith("mission."):
            self.buffer.add(event)


def routes(feed: MissionFeed) -> APIRouter:
    """Return the route."""
    router = APIRouter(tags=["mission"])

    def follow(woken: Annotated[asyncio.Event, Depends(feed.buffer.reading)]) -> Iterator[asyncio.Event]:
        feed.enter()
        try:
            yield woken
        finally:
            feed.leave()

    @router.get(
        "/mission/events",
        response_class=EventSourceResponse,
        responses=declared_stream(
            "`transitions` holds the changes of one tick; any other event is as in `/events`, its kind begins with "
            "`mission.`. An event `gap` tells how many were missed (null: unknown): read `/mission` again, as after a "
            "`structure` that is another than before.",
            MissionTransitions,
            Event,
        ),
    )
    async def stream_mission(
        woken: Annotated[asyncio.Event, Depends(follow)], last_event_id: LastEventId = ""
    ) -> AsyncIterator[ServerSentEvent]:
        """The mission as it goes: changes of statuses by tick, and loading, starting, swapping, writing, ending."""
        async for event in stream(feed.buffer, woken, last_event_id):
            yield event

    return router
