"""The route that follows a mission: changes of its nodes' statuses, and what happens to it, server-sent."""

import asyncio
import threading
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from typing import Annotated, Any

from fastapi import APIRouter, Depends
from fastapi.sse import EventSourceResponse, ServerSentEvent

from regraft.bus.interface import Closable
from regraft.bus_schema.messages.health import Event
from regraft.bus_schema.messages.mission import MissionTransitions
from regraft.bus_schema.model.robots.executors import MissionExecutor
from regraft.dashboard_api.backend.event_buffer import EventBuffer
from regraft.dashboard_api.backend.missions import Missions
from regraft.dashboard_api.http.problems import declared
from regraft.dashboard_api.routes.events import LastEventId, declared_stream, stream
from regraft.dashboard_api.routes.mission import Robot


class MissionFeed:
    """Listens to a mission while somebody reads: while nobody does, the executor makes no transitions."""

    def __init__(self, missions: Missions, executor: MissionExecutor, buffer: EventBuffer) -> None:
        """Keep what comes in ``buffer``."""
        self.buffer = buffer
        self._client = missions.client
        self._executor = executor
        self._lock = threading.Lock()
        self._readers = 0
        self._listening: list[Closable] = []

    def enter(self) -> None:
        """Begin to listen for the first reader; may take a second."""
        with self._lock:
            if not self._readers:
                self.buffer.restart()
                self._listening = [
                    self._client.topic(self._executor.transitions, MissionTransitions, self._take),
                    self._client.events(self._take_event),
                ]
            self._readers += 1

    def leave(self) -> None:
        """Listen no more once the last reader has left."""
        with self._lock:
            self._readers -= 1
            if self._readers == 0:
                for listening in self._listening:
                    listening.close()
                self._listening = []

    def _take(self, sample: Any) -> None:
        self.buffer.add_message("transitions", sample.message)

    def _take_event(self, event: Event) -> None:
        if event.kind.startswith("mission.") and self._executor.component in ("", event.subject):
            self.buffer.add(event)


class MissionFeeds:
    """A feed for each executor that somebody has asked for."""

    def __init__(self, missions: Missions, buffer: EventBuffer) -> None:
        """Have the feeds closed with ``buffer``."""
        self._missions = missions
        self._buffer = buffer
        self._lock = threading.Lock()
        self._feeds: dict[tuple[str, str], MissionFeed] = {}

    def of(self, robot: Robot = "") -> MissionFeed:
        """Return the feed of a robot's mission, or of the only one; raises Problem."""
        executor = self._missions.executor(robot)
        known_by = executor.component, executor.transitions
        with self._lock:
            if known_by not in self._feeds:
                self._feeds[known_by] = MissionFeed(self._missions, executor, self._buffer.beside())
            return self._feeds[known_by]


def routes(feeds: MissionFeeds) -> APIRouter:
    """Return the route."""
    router = APIRouter(tags=["mission"])

    async def reading(feed: Annotated[MissionFeed, Depends(feeds.of)]) -> AsyncIterator[asyncio.Event]:
        async with asynccontextmanager(feed.buffer.reading)() as woken:
            yield woken

    def follow(
        feed: Annotated[MissionFeed, Depends(feeds.of)], _: Annotated[asyncio.Event, Depends(reading)]
    ) -> Iterator[EventBuffer]:
        feed.enter()
        try:
            yield feed.buffer
        finally:
            feed.leave()

    @router.get(
        "/mission/events",
        response_class=EventSourceResponse,
        responses=declared(404)
        | declared_stream(
            "`transitions` holds the changes of one tick; any other event is as in `/events`, its kind begins with "
            "`mission.`. An event `gap` tells how many were missed (null: unknown): read `/mission` again, as after a "
            "`structure` that is another than before.",
            MissionTransitions,
            Event,
        ),
    )
    async def stream_mission(
        buffer: Annotated[EventBuffer, Depends(follow)],
        woken: Annotated[asyncio.Event, Depends(reading)],
        last_event_id: LastEventId = "",
    ) -> AsyncIterator[ServerSentEvent]:
        """The mission as it goes: changes of statuses by tick, and loading, starting, swapping, writing, ending."""
        async for event in stream(buffer, woken, last_event_id):
            yield event

    return router
