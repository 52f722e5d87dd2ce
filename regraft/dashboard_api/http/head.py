"""``HEAD`` wherever ``GET`` is: the same answer without its body."""

from __future__ import annotations

import asyncio

from starlette.types import ASGIApp, Message, Receive, Scope, Send


class Head:
    """An ASGI middleware that answers HEAD by what the application would answer to GET."""

    def __init__(self, app: ASGIApp) -> None:
        """Answer by ``app``."""
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        if scope["type"] != "http" or scope["method"] != "HEAD":
            await self._app(scope, receive, send)
            return
        answered = asyncio.Event()

        async def take() -> Message:
            # An endless answer ends as if the client had left: that is looked for below version 2.4.
            await answered.wait()
            return {"type": "http.disconnect"}

        async def put(message: Message) -> None:
            if message["type"] == "http.response.start":
                await send(message)
                await send({"type": "http.response.body", "body": b"", "more_body": False})
                answered.set()

        asgi = {**scope.get("asgi", {}), "spec_version": "2.3"}
        await self._app({**scope, "method": "GET", "asgi": asgi}, take, put)
