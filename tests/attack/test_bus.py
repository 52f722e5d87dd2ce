"""Random bytes and forged messages at every key of a running system harm nobody."""

from __future__ import annotations

import random
import time
from collections.abc import Callable

import pytest

from regraft.bus_schema.encoding.envelope import Envelope
from regraft.bus_schema.keys import CONTROL_VERBS
from tests.attack.tally import Tally
from tests.hostile.bus.raw import Raw, stranger
from tests.hostile.bus.test_garbage import BAD_PAYLOADS, HOST_VERBS, KEYS
from tests.hostile.conftest import SOURCE, Start
from tests.hostile.parts import Number, Word
from tests.support.systems import System
from tests.support.waiting import wait_until

pytestmark = [pytest.mark.attack, pytest.mark.timeout(600)]

PAYLOADS = 2000
QUESTIONS = 500
FORGERIES = 100
LEDGER = "  ledger: {class: 'tests.hostile.parts:Ledger'}\n"


def _ask(system: System, service: str) -> int:
    return int(system.client.call(service, Word(""), Word).count)


def _all_is_well(system: System) -> None:
    newest = _ask(system, "newest")
    wait_until(lambda: _ask(system, "newest") > newest + 10, "further numbers to be heard")
    assert _ask(system, "amiss") == 0
    assert {name: process.incarnation for name, process in system.processes().items()} == {"ledger": 1, "source": 1}


def _bytes(chance: random.Random) -> bytes:
    return chance.choice((chance.choice(BAD_PAYLOADS), chance.randbytes(chance.randint(0, 400))))


def _envelope(chance: random.Random) -> bytes:
    source = chance.choice(("stranger", "nobody", "*/.."))
    epoch, run = (chance.choice((0, 1, 2**31, 2**32 - 1)) for _ in range(2))
    sequence = chance.choice((0, 1, 10**9, 2**64 - 1))
    return chance.choice(
        (b"", chance.randbytes(chance.randint(0, 200)), Envelope(source, epoch, run, sequence, 0).to_bytes())
    )


@pytest.fixture
def system(start: Start) -> System:
    """Return a source of numbers, and a ledger that knows whether one is missing."""
    system = start(SOURCE + LEDGER)
    for name in ("source", "ledger"):
        system.wait_running(name)
    wait_until(lambda: _ask(system, "newest") > 10)
    return system


def test_random_payloads_and_questions_harm_nobody(system: System, chance: random.Random, tally: Tally) -> None:
    keys = [key for where in KEYS.values() for key in where(system)]
    with stranger(system.info) as raw, tally.one("system under random bytes"):
        for _ in range(PAYLOADS):
            encoding = chance.choice(("", "regraft/Request@1", "hostile_tests/Number@1", "nonsense"))
            raw.put(chance.choice(keys), _bytes(chance), encoding, _envelope(chance))
        for _ in range(QUESTIONS):
            raw.ask(_question(system, chance), _bytes(chance), 1.0)
        _all_is_well(system)
    tally.many("random payload on the bus", PAYLOADS)
    tally.many("random question on the bus", QUESTIONS)


def _question(system: System, chance: random.Random) -> str:
    asked: Callable[[], str] = chance.choice(
        (
            lambda: system.client.keys.control(chance.choice(("source", "ledger")), 1, chance.choice(CONTROL_VERBS)),
            lambda: system.client.keys.host("local", chance.choice(HOST_VERBS)),
        )
    )
    return asked()


def test_forged_messages_of_a_member_mute_nobody(system: System, chance: random.Random, tally: Tally) -> None:
    with stranger(system.info) as raw:
        for number in range(FORGERIES):
            with tally.one("message forged in a member's name", f"number {number}"):
                _forge(system, raw, chance)
                _all_is_well(system)


def _forge(system: System, raw: Raw, chance: random.Random) -> None:
    incarnation = chance.choice((1, 1, 2, 1000, 2**32 - 1))
    sequence = chance.choice((10**4, 10**6, 10**9, 2**63, int(time.time()) * 1000))
    raw.say(system.client.keys.topic("numbers"), Number(-1.0, b"forged"), "source", incarnation, sequence)
