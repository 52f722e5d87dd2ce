"""One faulty member of a system neither mutes the others, nor takes their orders from them, nor hides them."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.protocol.control import ControlCode, ControlError, ParameterValues
from regraft.bus_schema.messages.protocol.host import StopComponent
from regraft.bus_schema.model.adaptation import Outcome, SetParameters
from regraft.bus_schema.model.lifecycle import State
from tests.hostile.bus.raw import Raw, stranger
from tests.hostile.conftest import SOURCE, Start
from tests.hostile.parts import Number, Word
from tests.support.systems import System
from tests.support.waiting import wait_until

pytestmark = pytest.mark.slow

PARTS = """\
  ledger: {class: 'tests.hostile.parts:Ledger'}
  adaptation_manager:
    class: 'regraft.adaptation_manager.manager:AdaptationManager'
    parameters: {journal: $RUN/journal.sqlite}
"""
MANY = 10**9
LAST_RUN = 2**32 - 1


@pytest.fixture(scope="module")
def system(start_for_all: Start) -> System:
    system = start_for_all(SOURCE + PARTS)
    for name in ("source", "ledger", "adaptation_manager"):
        system.wait_running(name)
    wait_until(lambda: system.client.host_view("local").term > 0, "a manager in charge")
    return system


@pytest.fixture
def raw(system: System) -> Iterator[Raw]:
    with stranger(system.info) as raw:
        yield raw


def _ask(system: System, service: str) -> int:
    return int(system.client.call(service, Word(""), Word).count)


def _refused(system: System) -> int:
    status = system.client.components()["ledger"].status
    return status.refused if status else 0


def _hears_what_follows(system: System) -> None:
    newest = _ask(system, "newest")
    wait_until(lambda: _ask(system, "newest") > newest + 20, "further numbers to be heard")
    assert _ask(system, "amiss") == 0


@pytest.mark.parametrize(("incarnation", "sequence"), [(1, MANY), (1, 2**63), (LAST_RUN, 1), (LAST_RUN, MANY), (2, 1)])
def test_a_message_from_far_ahead_mutes_no_stream(system: System, raw: Raw, incarnation: int, sequence: int) -> None:
    wait_until(lambda: _ask(system, "newest") > 0)
    refused = _refused(system)
    raw.say(system.client.keys.topic("numbers"), Number(-1.0, b"forged"), "source", incarnation, sequence)
    wait_until(lambda: _refused(system) > refused, "the ledger to notice")
    _hears_what_follows(system)


@pytest.mark.parametrize("term", [2, 900, 10**9, 2**62])
def test_a_term_that_has_not_begun_is_not_obeyed(system: System, raw: Raw, term: int) -> None:
    before = system.client.view("source").parameters
    asked = codec.encode(ParameterValues({"step": 7.0}, term))
    ((is_error, answer),) = raw.ask(system.client.keys.control("source", 1, "parameters"), asked)
    assert is_error
    assert codec.decode(answer, ControlError).code is ControlCode.FENCED
    assert system.client.view("source").parameters == before
    assert system.client.adapt(SetParameters("source", {"step": 1.0})).outcome is Outcome.APPLIED


def test_a_host_obeys_no_term_from_far_ahead(system: System, raw: Raw) -> None:
    asked = codec.encode(StopComponent("source", 0.0, MANY))
    ((is_error, answer),) = raw.ask(system.client.keys.host("local", "stop"), asked)
    assert is_error
    assert codec.decode(answer, ControlError).code is ControlCode.FENCED
    assert system.client.adapt(SetParameters("source", {"step": 1.0})).outcome is Outcome.APPLIED


@pytest.mark.parametrize("run", [2, 1000, LAST_RUN, 10**30])
def test_a_token_of_a_run_that_there_is_not_hides_nothing(system: System, raw: Raw, run: int) -> None:
    token = raw.token(system.client.keys.alive("ledger", run))
    with stranger(system.info) as other:
        key = system.client.keys.alive("ledger", "*")
        wait_until(lambda: len(list(other.session.liveliness().get(key, timeout=1.0))) == 2)
    shown = system.client.components()["ledger"]
    assert shown.status is not None
    assert (shown.alive, shown.status.incarnation, shown.status.state) == (True, 1, State.ACTIVE)
    assert system.client.view("ledger").incarnation == 1
    token.undeclare()
