"""The route of events: server-sent, so that a page or ``curl -N`` sees them as they happen."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncGenerator, AsyncIterator
from typing import Annotated, Any

from fastapi import APIRouter, Header
from starlette.responses import Response, StreamingResponse
from starlette.types import Receive, Scope, Send

from regraft.bus_schema.messages.health import Event
from regraft.dashboard_api.backend.event_buffer import EventBuffer
from regraft.dashboard_api.http.json_replies import ref
from regraft.dashboard_api.http.problems import declared, unavailable

MAX_READERS = 32
RECONNECT_TIMEOUT = 1000
"""Milliseconds after which a reader whose connection broke is to come back."""

EVENT_STREAM: dict[int | str, dict[str, Any]] = {
    200: {
        "description": (
            "Server-sent events: `event` is the kind, `data` the event as JSON, `id` what to send as Last-Event-ID to "
            "go on behind it. An event `gap` tells how many were missed (null: unknown). Comments keep it alive."
        ),
        "content": {"text/event-stream": {"schema": {"type": "string"}, "itemSchema": ref(Event)}},
    }
}


class Seats:
    """The places that readers of a stream have, all taken and given back in the server's event loop."""

    def __init__(self) -> None:
        self._taken = 0

    def take(self, text: AsyncIterator[str]) -> StreamOfEvents:
        """Return a stream for one more reader, who has a place from now until it has ended; raises Problem."""
        if self._taken >= MAX_READERS:
            raise unavailable(f"{MAX_READERS} readers are being sent these events already")
        self._taken += 1
        return StreamOfEvents(text, self)

    def give_back(self) -> None:
        """Let somebody else read."""
        self._taken -= 1


class StreamOfEvents(StreamingResponse):
    """A stream that gives its place back, however it ends."""

    media_type = "text/event-stream"

    def __init__(self, text: AsyncIterator[str], seats: Seats) -> None:
        """Send ``text`` as it comes, to a reader who has one of the ``seats``."""
        super().__init__(text, headers={"X-Accel-Buffering": "no"})
        self._seats = seats

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send it."""
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._seats.give_back()


def routes(buffer: EventBuffer, heartbeat: float) -> APIRouter:
    """Return the route; a comment is sent after ``heartbeat`` seconds of silence."""
    router = APIRouter(tags=["events"])
    seats = Seats()

    @router.get("/events", response_class=StreamingResponse, responses={**EVENT_STREAM, **declared(422, 503)})
    async def stream_events(
        last_event_id: Annotated[str | None, Header(description="Go on behind this event")] = None,
    ) -> Response:
        """Stream events as they happen: adaptations, faults, transitions, restarts."""
        return seats.take(stream(buffer, last_event_id, heartbeat))

    return router


async def stream(buffer: EventBuffer, last_event_id: str | None, heartbeat: float) -> AsyncGenerator[str]:
    """Yield the text of a stream: what is behind an event, then what comes, comments in between."""
    resumed = buffer.resume(last_event_id)
    position = resumed or 0
    with buffer.reading() as woken:
        yield f"retry: {RECONNECT_TIMEOUT}\n: from {buffer.identifier(position)}\n\n"
        if resumed is None:
            yield _gap(None)
        while not buffer.closed:
            woken.clear()
            events, missed = buffer.after(position)
            if missed and resumed is not None:
                yield _gap(missed)
            resumed = position
            for event in events:
                yield f"event: {event.kind}\nid: {buffer.identifier(event.number)}\ndata: {event.text}\n\n"
            position = events[-1].number if events else position
            try:
                await asyncio.wait_for(woken.wait(), heartbeat)
            except TimeoutError:
                yield ": alive\n\n"


def _gap(missed: int | None) -> str:
    return f"event: gap\ndata: {json.dumps({'missed': missed})}\n\n"
