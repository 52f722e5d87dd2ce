"""The route of events: server-sent, so that a page or ``curl -N`` sees them as they happen."""

import asyncio
from collections.abc import AsyncIterator
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Header
from fastapi.sse import EventSourceResponse, ServerSentEvent

from regraft.bus_schema.encoding.records import record_shape
from regraft.bus_schema.messages.health import Event
from regraft.dashboard_api.backend.event_buffer import EventBuffer
from regraft.dashboard_api.http.problems import declared

RECONNECT_TIMEOUT = 1000
"""Milliseconds after which a reader whose connection broke is to come back."""

LastEventId = Annotated[str, Header(description="Go on behind this event")]


def declared_stream(description: str, *messages: type) -> dict[int | str, dict[str, Any]]:
    """Return, for OpenAPI, the answers of a route that sends messages as events."""
    schemas = [record_shape(message).json_schema() for message in messages]
    data = {"type": "string", "contentMediaType": "application/json", "contentSchema": {"anyOf": schemas}}
    content = {"text/event-stream": {"itemSchema": {"properties": {"data": data}}}}
    return {200: {"description": f"Server-sent events: {description}", "content": content}, **declared(422, 503)}


def routes(buffer: EventBuffer) -> APIRouter:
    """Return the route."""
    router = APIRouter(tags=["events"])

    @router.get(
        "/events",
        response_class=EventSourceResponse,
        responses=declared_stream(
            "`event` is the kind, `data` the event as JSON, `id` what to send as Last-Event-ID to go on behind it. An "
            "event `gap` tells how many were missed (null: unknown). Comments keep it alive.",
            Event,
        ),
    )
    async def stream_events(
        woken: Annotated[asyncio.Event, Depends(buffer.reading)], last_event_id: LastEventId = ""
    ) -> AsyncIterator[ServerSentEvent]:
        """Stream events as they happen: adaptations, faults, transitions, restarts."""
        async for event in stream(buffer, woken, last_event_id):
            yield event

    return router


async def stream(buffer: EventBuffer, woken: asyncio.Event, last_event_id: str) -> AsyncIterator[ServerSentEvent]:
    """Yield what is behind an event, then what comes."""
    resumed = buffer.resume(last_event_id)
    position = resumed or 0
    # An id without data is no event: by it, a page whose connection breaks before the first event continues from here.
    # After a foreign one the page keeps that, until it has the gap and an event.
    here = buffer.identifier(position)
    yield ServerSentEvent(retry=RECONNECT_TIMEOUT, id=None if resumed is None else here, comment=f"from {here}")
    if resumed is None:
        yield _gap(None)
    while not buffer.closed:
        woken.clear()
        events, missed = buffer.after(position)
        if missed and resumed is not None:
            yield _gap(missed)
        resumed = position
        for event in events:
            yield ServerSentEvent(event=event.kind, id=buffer.identifier(event.number), raw_data=event.text)
        position = events[-1].number if events else position
        await woken.wait()


def _gap(missed: int | None) -> ServerSentEvent:
    return ServerSentEvent(event="gap", data={"missed": missed})
