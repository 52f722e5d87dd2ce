"""What strangers put on the bus of a running system, however bad, harms nobody."""

from __future__ import annotations

import contextlib
import os
import random
import struct
from collections.abc import Callable, Iterator

import msgpack
import pytest

from regraft import CallFailed
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.envelope import Envelope
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.keys import CONTROL_VERBS
from regraft.bus_schema.messages.protocol.control import ControlError
from regraft.bus_schema.messages.protocol.requests import Request, Verb
from regraft.client import ClientError
from tests.hostile.bus.raw import Raw, stranger
from tests.hostile.components.test_bad_components import heard
from tests.hostile.conftest import SINK, SOURCE, Start
from tests.hostile.parts import Number, Word
from tests.support.stepped.site import BEYOND
from tests.support.systems import System
from tests.support.waiting import wait_until

pytestmark = pytest.mark.slow

HOST_VERBS = ("view", "specs", "start", "stop", "logs")
MAP_WITHIN_MAP = b"\x81\xa1a" * 5000 + b"\xc0"
LISTS = b"\x91" * 100_000 + b"\xc0"
ANNOUNCES_MUCH = b"\xdd\xff\xff\xff\xff"
NUMBERS_FOR_KEYS = b"\x82\x01\x02\x03\x04"
BAD_PAYLOADS = (b"", b"\x00", b"\xc1", MAP_WITHIN_MAP, LISTS, ANNOUNCES_MUCH, NUMBERS_FOR_KEYS, b"\xff" * 1000)


def _garbage(seed: int, count: int) -> Iterator[bytes]:
    dice = random.Random(seed)
    yield from BAD_PAYLOADS
    for _ in range(count):
        yield dice.randbytes(dice.randint(0, 300))


def _up(start: Start) -> System:
    system = start(SOURCE + SINK)
    for name in ("source", "sink"):
        system.wait_running(name)
    return system


@pytest.fixture(scope="module")
def system(start_for_all: Start) -> System:
    return _up(start_for_all)


@pytest.fixture
def raw(system: System) -> Iterator[Raw]:
    with stranger(system.info) as raw:
        yield raw


def _states(system: System) -> dict[str, str]:
    return {name: s.status.state.value for name, s in system.client.components().items() if s.status}


def _goes_on(system: System) -> None:
    before = heard(system)
    wait_until(lambda: heard(system) > before + 10, "the sink to hear more")
    wait_until(lambda: _states(system) == {"source": "active", "sink": "active"}, "both to be active")
    assert {name: p.incarnation for name, p in system.processes().items()} == {"source": 1, "sink": 1}


def _refused(system: System, source: str) -> list[str]:
    return [event.text for event in system.said("message.refused", "sink") if source in event.text]


KEYS: dict[str, Callable[[System], list[str]]] = {
    "topics": lambda s: [s.client.keys.topic("numbers"), s.client.keys.topic("never/heard/of")],
    "services": lambda s: [s.client.keys.request("heard"), s.client.keys.reply("heard", s.client.name)],
    "status": lambda s: [
        *(s.client.keys.status(name) for name in ("source", "sink", "nobody")),
        s.client.keys.checkpoint("source"),
    ],
    "hosts": lambda s: [s.client.keys.host("local", "status"), s.client.keys.host("other", "status")],
    "clock": lambda s: [
        s.client.keys.clock(part) for part in ("time", "ack", "join", "marker_ack", "slot_request", "step/sink")
    ],
    "events": lambda s: [s.client.keys.event, s.client.keys.diagnostics],
}


@pytest.mark.parametrize("where", KEYS)
def test_garbage_put_anywhere_harms_nobody(system: System, raw: Raw, where: str) -> None:
    envelopes = (
        b"",
        b"\x01",
        os.urandom(300),
        Envelope("source", 1, 1, 1, 0).to_bytes(),
        Envelope("stranger", 2**32 - 1, 2**32 - 1, 2**64 - 1, -(2**63)).to_bytes(),
        Envelope("*/..", 1, 1, 5, 0).to_bytes(),
    )
    for key in KEYS[where](system):
        for number, payload in enumerate(_garbage(1, 100)):
            raw.put(key, payload, ("", "regraft/Request@1", "nonsense")[number % 3], envelopes[number % len(envelopes)])
    _goes_on(system)


def test_a_status_whose_state_is_an_array_harms_nobody(system: System, raw: Raw) -> None:
    array = msgpack.ExtType(1, b"<f4" + struct.pack("<BI", 1, 2) + bytes(8))
    for source in ("source", "sink", "nobody"):
        raw.put(
            system.client.keys.status(source),
            codec.pack_plain({"component": source, "incarnation": 1, "state": array, "revision": 1}),
            "regraft/ComponentStatus@1",
            Envelope(source, 1, 1, 1, 0).to_bytes(),
        )
    _goes_on(system)


def test_garbage_asked_of_a_component_is_answered_with_what_is_wrong(system: System, raw: Raw) -> None:
    for verb in CONTROL_VERBS[1:]:
        for payload in BAD_PAYLOADS[1:]:
            answers = raw.ask(system.client.keys.control("sink", 1, verb), payload)
            assert len(answers) == 1
            assert answers[0][0], verb
            assert codec.decode(answers[0][1], ControlError).problems[0].startswith(verb)
    for key in ("tests/component/sink/1/nonsense", "tests/component/sink/1/*", "tests/component/sink/*/describe"):
        raw.ask(key, b"\xff", 0.5)
    _goes_on(system)


def test_garbage_asked_of_a_host_is_answered_with_what_is_wrong(system: System, raw: Raw) -> None:
    for verb in HOST_VERBS[1:]:
        for payload in BAD_PAYLOADS:
            answers = raw.ask(system.client.keys.host("local", verb), payload)
            assert len(answers) == 1
            assert answers[0][0], verb
            assert codec.decode(answers[0][1], ControlError).problems[0].startswith(verb)
    for key in ("tests/host/local/*", "tests/host/*/stop", "tests/**", "**"):
        raw.ask(key, b"\xff", 0.5)
    _goes_on(system)


def test_a_message_of_another_type_is_refused_and_said(system: System, raw: Raw) -> None:
    raw.say(system.client.keys.topic("numbers"), Word("hello"), "foreigner")
    wait_until(lambda: _refused(system, "foreigner"))
    said = _refused(system, "foreigner")[0]
    assert "hostile_tests/Number" in said
    assert "hostile_tests/Word@1" in said
    _goes_on(system)


def test_the_system_outlives_messages_beyond_64_megabytes(start: Start) -> None:
    system = _up(start)
    keys = system.client.keys
    with stranger(system.info) as raw:
        envelope = Envelope("boaster", 1, 1, 1, 0).to_bytes()
        raw.put(keys.topic("numbers"), bytes(BEYOND), type_of(Number).encoding, envelope)
        for key in (keys.request("heard"), keys.status("sink"), keys.host("local", "status"), keys.event):
            raw.put(key, bytes(BEYOND))
    _recovers(system)
    assert all("must be at most 67108864" in text for text in _refused(system, "boaster"))


def test_the_system_outlives_questions_beyond_64_megabytes(start: Start) -> None:
    system = _up(start)
    keys = system.client.keys
    with stranger(system.info) as raw:
        for key in (keys.control("sink", 1, "parameters"), keys.host("local", "stop")):
            for is_error, answer in raw.ask(key, bytes(BEYOND)):
                assert is_error
                assert "must be at most" in codec.decode(answer, ControlError).problems[0]
        wait_until(lambda: _answers(raw, keys.host("local", "view")), "an answer of the host")
    _recovers(system)


def _recovers(system: System) -> None:
    """Wait until all goes on.

    A busy machine cannot pass on so much within the time that a put may block: the link is then closed, what was under
    way on it is lost, and whoever is not back in time may even be taken for hung and restarted.
    """

    def more() -> bool:
        with contextlib.suppress(CallFailed, ClientError):
            before = heard(system, 2.0)
            return heard(system, 2.0) > before and system.client.view("sink").parameters == {"delay": 0.0}
        return False

    wait_until(more, "the sink to hear more and to answer")
    wait_until(lambda: _states(system) == {"source": "active", "sink": "active"}, "both to be active")


def _answers(raw: Raw, key: str) -> bool:
    return [is_error for is_error, _ in raw.ask(key, b"", 5.0)] == [False]


def test_clients_that_never_hear_their_answer_keep_nobody_else_from_theirs(system: System, raw: Raw) -> None:
    key, encoding = system.client.keys.request("heard"), type_of(Request).encoding
    for number in range(300):
        request = Request(f"gone-{number}", 1, Verb.CALL, {"text": ""}, 1.0)
        raw.put(key, codec.encode(request), encoding, Envelope(f"gone-{number}", 1, 1, 1, 0).to_bytes())
    assert heard(system) >= 0
    _goes_on(system)


NAMES = ["", "*", "**", "a/b", "../x", "$*", "x?y", "#", "\u202e", "n" * 5000]


@pytest.mark.parametrize("name", NAMES)
def test_a_client_whose_name_is_none_is_refused(system: System, raw: Raw, name: str) -> None:
    key, encoding = system.client.keys.request("heard"), type_of(Request).encoding
    source = f"nameless-{NAMES.index(name)}"
    raw.put(
        key,
        codec.pack_plain({"client": name, "number": 1, "verb": "call", "body": {"text": ""}, "patience": 1.0}),
        encoding,
        Envelope(source, 1, 1, 1, 0).to_bytes(),
    )
    wait_until(lambda: _refused(system, source))
    _goes_on(system)


def test_a_flood_from_outside_leaves_the_system_responsive(start: Start) -> None:
    system = _up(start)
    key, encoding = system.client.keys.topic("numbers"), type_of(Number).encoding
    payload = codec.encode(Number(1.0, bytes(1000)))
    with stranger(system.info) as raw:
        for number in range(1, 30_000):
            raw.put(key, payload, encoding, Envelope("flooder", 1, 1, number, 0).to_bytes())
    assert heard(system) > 0
    _goes_on(system)
