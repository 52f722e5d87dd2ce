"""A list of the tokens that are there is whole, whenever it is asked for."""

from __future__ import annotations

from contextlib import closing
from functools import partial

from regraft.zenoh_bus import ZenohBus, open_bus
from regraft.zenoh_config import Endpoints
from tests.ports import free_port
from tests.waiting import wait_until

EACH = "s/*/alive"
TOKENS = [f"s/{name}/alive" for name in ("camera", "lidar", "navigator", "planner")]


def _lists_all(bus: ZenohBus) -> bool:
    return sorted(bus.present(EACH, 1.0)) == TOKENS


def test_a_session_that_begins_to_watch_lists_at_once_all_that_are_there() -> None:
    port = free_port()
    at_hub = Endpoints(connect=(f"tcp/127.0.0.1:{port}",))
    router = open_bus(Endpoints(listen=(f"tcp/127.0.0.1:{port}",), router=True))
    with closing(router), closing(open_bus(at_hub)) as others:
        for token in TOKENS:
            others.announce(token)
        wait_until(lambda: _lists_all(router), "the tokens")
        for _ in range(30):
            with closing(open_bus(at_hub)) as session:
                wait_until(partial(_lists_all, session), "the link")
                session.watch(EACH, lambda presence: None)
                assert _lists_all(session)
