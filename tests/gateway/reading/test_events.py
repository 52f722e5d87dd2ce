from __future__ import annotations

import json
import socket
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx
import pytest
from fastapi import routing

from regraft.bus_schema.messages.health import Event
from regraft.dashboard_api.backend.event_buffer import EventBuffer
from regraft.dashboard_api.gateway import Gateway
from tests.gateway.conftest import Running
from tests.support.waiting import PATIENCE, wait_until


@dataclass
class Told:
    kind: str
    id: str
    data: Any


def parse(lines: Iterator[str]) -> Iterator[Told]:
    """Read a stream of server-sent events; the opening comes as a ``comment``."""
    fields: dict[str, str] = {}
    for line in lines:
        if line:
            name, _, value = line.partition(": ")
            fields[name or "comment"] = value
        elif "data" in fields:
            yield Told(fields["event"], fields.get("id", ""), json.loads(fields["data"]))
            fields = {}
        else:
            yield Told("comment", "", fields)
            fields = {}


@contextmanager
def reading(running: Running, last: str | None = None) -> Iterator[Iterator[Told]]:
    """Read events, beginning when the stream is open."""
    headers = {"Last-Event-ID": last} if last is not None else {}
    with (
        running.connect() as http,
        http.stream("GET", "/events", headers=headers) as response,
    ):
        assert response.status_code == 200
        assert response.headers["content-type"].startswith("text/event-stream")
        events = parse(response.iter_lines())
        assert next(events).kind == "comment"
        yield events


def gateway_of(running: Running) -> Gateway:
    gateway = running.site.runtimes["gateway"].component
    assert isinstance(gateway, Gateway)
    return gateway


def buffer_of(running: Running) -> EventBuffer:
    buffer = gateway_of(running)._buffer
    assert buffer
    return buffer


def tell(running: Running, kind: str, text: str = "") -> None:
    """Have the navigator tell of something."""
    runtime = running.site.runtimes["navigator"]
    runtime.post(lambda: runtime.reporter.event(kind, text))


@pytest.fixture
def running(shared: Running) -> Running:
    """Return the robot of the file, once the readers of the test before have left."""
    wait_until(lambda: buffer_of(shared).readers == 0, "the readers to leave")
    return shared


def test_events_are_sent_as_they_happen(running: Running) -> None:
    with reading(running) as events:
        tell(running, "battery.low", "7 % left")
        told = next(events)
    assert told.kind == "battery.low"
    assert (told.data["subject"], told.data["text"]) == ("navigator", "7 % left")


def test_a_reader_goes_on_where_its_connection_broke(running: Running) -> None:
    with reading(running) as events:
        for n in range(3):
            tell(running, "count", str(n))
        first = next(events)
    for n in range(3, 6):
        tell(running, "count", str(n))
    with reading(running, first.id) as events:
        texts = [next(events).data["text"] for _ in range(5)]
    assert texts == ["1", "2", "3", "4", "5"]


@pytest.mark.parametrize("path", ["events", "mission/events"])
def test_a_reader_goes_on_whose_connection_broke_before_its_first_event(running: Running, path: str) -> None:
    def opened(last: str = "") -> tuple[Any, Iterator[Told]]:
        http = stack.enter_context(running.connect())
        response = stack.enter_context(http.stream("GET", f"/{path}", headers={"Last-Event-ID": last} if last else {}))
        events = parse(response.iter_lines())
        return next(events).data, events

    with ExitStack() as stack:
        opening, _ = opened()
        # Another reader stays: the mission is listened to meanwhile.
        _, others = opened()
        tell(running, "mission.count", "missed")
        assert next(others).data["text"] == "missed"
        _, events = opened(opening["id"])
        assert next(events).data["text"] == "missed"
        foreign, _ = opened("0badcafe-7")
        assert "id" not in foreign


def test_a_reader_that_was_away_too_long_is_told_how_much_it_missed(running: Running) -> None:
    with reading(running) as events:
        tell(running, "count", "first")
        first = next(events)
    for n in range(1500):
        tell(running, "count", str(n))
    last = int(first.id.rpartition("-")[2])
    wait_until(lambda: buffer_of(running).last == last + 1500)
    with reading(running, first.id) as events:
        gap, following = next(events), next(events)
    assert (gap.kind, gap.data) == ("gap", {"missed": 500})
    assert following.data["text"] == "500"


@pytest.mark.parametrize("foreign", ["0badcafe-7", "nonsense", "-", "x-99999999999999999999999", "²-²"])
def test_the_identifier_of_another_run_is_not_mistaken_for_this_ones(running: Running, foreign: str) -> None:
    tell(running, "count", "kept")
    kept = buffer_of(running)
    wait_until(lambda: any(event.kind == "count" for event in kept.after(0)[0]))
    headers = [(b"Last-Event-ID", foreign.encode())]
    with running.connect() as http, http.stream("GET", "/events", headers=headers) as response:
        events = parse(response.iter_lines())
        next(events)
        gap = next(events)
        assert (gap.kind, gap.data) == ("gap", {"missed": None})
        assert any(told.kind == "count" for told in events)


def test_a_kind_cannot_break_out_of_its_line(running: Running) -> None:
    with reading(running) as events:
        tell(running, "a\n\ndata: forged", "x\n\ny")
        told = next(events)
    assert told.kind == "a__data__forged"
    assert told.data["text"] == "x\n\ny"


def test_readers_that_leave_are_forgotten(running: Running) -> None:
    buffer = buffer_of(running)
    for _ in range(5):
        with reading(running):
            assert buffer.readers >= 1
    wait_until(lambda: buffer.readers == 0)


def test_the_number_of_readers_is_bounded(running: Running) -> None:
    streams = [reading(running) for _ in range(32)]
    for stream in streams:
        stream.__enter__()
    with running.connect() as http:
        refused = http.get("/events")
    assert refused.status_code == 503
    assert running.http.get("/hosts").status_code == 200
    for stream in streams:
        stream.__exit__(None, None, None)
    wait_until(lambda: buffer_of(running).readers == 0)


@pytest.mark.parametrize("path", ["events", "mission/events"])
def test_readers_that_come_all_at_once_are_no_more(running: Running, path: str) -> None:
    parts = urlsplit(running.url)
    asked = f"GET {parts.path}/{path} HTTP/1.1\r\nHost: {parts.netloc}\r\n\r\n".encode()
    with ExitStack() as opened:
        address = (str(parts.hostname), parts.port or 80)
        readers = [opened.enter_context(socket.create_connection(address, PATIENCE)) for _ in range(100)]
        for reader in readers:
            reader.sendall(asked)
        statuses = Counter(reader.recv(12).split()[1] for reader in readers)
    assert statuses == {b"200": 32, b"503": 68}

    def opens() -> bool:
        with httpx.stream("GET", f"{running.url}/{path}", timeout=PATIENCE, verify=False) as response:
            return response.status_code == 200

    wait_until(opens, "a place for another reader")


def test_a_stalled_reader_costs_bounded_memory() -> None:
    buffer = EventBuffer(size=10)
    for n in range(100):
        buffer.add(Event(0.0, "count", "x", str(n)))
    kept, missed = buffer.after(5)
    assert [event.number for event in kept] == list(range(91, 101))
    assert missed == 85


def test_silence_is_filled_with_comments(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from regraft.bus.memory_bus import MemoryBus, MemoryHub
    from regraft.client import Client
    from regraft.dashboard_api.app import build
    from regraft.dashboard_api.backend.manager import Services
    from regraft.dashboard_api.http.authentication import Callers
    from regraft.dashboard_api.server import HttpServer, bind
    from regraft.security.tokens import Tokens

    monkeypatch.setattr(routing, "_PING_INTERVAL", 0.01)
    buffer = EventBuffer()
    with Client(MemoryBus(MemoryHub()), "site") as client:
        app = build(Services(client, 1.0, 1.0), buffer, Callers(Tokens(tmp_path)), "127.0.0.1")
        server = HttpServer(app, bind("127.0.0.1", 0))
        server.start()
        with httpx.stream("GET", f"{server.url}/api/v1/events") as response:
            events = parse(response.iter_lines())
            comments = [next(events).data["comment"] for _ in range(3)]
        buffer.close()
        assert server.stop()
    assert comments[1:] == ["ping", "ping"]
