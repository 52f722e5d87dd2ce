"""Who speaks for the dead, for those not yet born, or without the manager's term is not believed."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.health import ComponentStatus
from regraft.bus_schema.messages.protocol.control import (
    ControlCode,
    ControlError,
    ParameterValues,
    Rewire,
    RewireStep,
    SetTransition,
    StateRequest,
    StateStep,
)
from regraft.bus_schema.messages.protocol.host import (
    HostStatus,
    ProcessState,
    ProcessStatus,
    StartComponent,
    StopComponent,
    UpdateSpecs,
)
from regraft.bus_schema.model.lifecycle import State, Transition
from tests.hostile.bus.raw import Raw, stranger
from tests.hostile.conftest import SINK, SOURCE, Start
from tests.hostile.parts import Word
from tests.support.frog import in_parallel, pause
from tests.support.systems import System
from tests.support.waiting import wait_until

pytestmark = pytest.mark.slow

HANGING = "  hanging: {class: 'tests.hostile.parts:Hanging'}\n"
MANAGER = (
    "  adaptation_manager: {class: 'regraft.adaptation_manager.manager:AdaptationManager',"
    " parameters: {journal: $RUN/journal.sqlite}}\n"
)


def _up(start: Start) -> System:
    system = start(SOURCE + SINK + HANGING)
    for name in ("source", "sink", "hanging"):
        system.wait_running(name)
    return system


@pytest.fixture(scope="module")
def system(start_for_all: Start) -> System:
    return _up(start_for_all)


def _hang(system: System) -> None:
    system.ask_until_it_ends("hanging", lambda: system.client.call("hang", Word(""), Word, 0.2))


@pytest.fixture
def raw(system: System) -> Iterator[Raw]:
    with stranger(system.info) as raw:
        yield raw


def _status(name: str, incarnation: int) -> ComponentStatus:
    return ComponentStatus(name, incarnation, State.FINALIZED, 99, 1e9, "forged", detail="http://forged:1/api/v1")


@pytest.fixture(scope="module")
def often_hung(start_for_all: Start) -> System:
    """Return a system whose component may hang as often as it likes."""
    return start_for_all(HANGING.replace("'}", "', restart: {limit: 100}}"))


@pytest.mark.parametrize("incarnation", [0, 1000, 2**32 - 1, 2**63 - 1])
def test_a_heartbeat_of_another_run_keeps_no_hung_component_alive(often_hung: System, incarnation: int) -> None:
    _found_hung_all_the_same(often_hung, incarnation)


def test_a_heartbeat_of_the_next_run_keeps_no_hung_component_alive(start: Start) -> None:
    _found_hung_all_the_same(_up(start), 2)


def _found_hung_all_the_same(system: System, incarnation: int) -> None:
    """Hang a component while somebody forges heartbeats of a run of it, and see that it is restarted."""
    run, stopped = system.wait_running("hanging").incarnation, False

    def forge() -> None:
        with stranger(system.info) as raw:
            while not stopped:
                raw.say(system.client.keys.status("hanging"), _status("hanging", incarnation), "hanging", 1)
                pause(0.001)

    forging = in_parallel(forge)
    try:
        _hang(system)
        again = system.wait_running("hanging", run + 1)
    finally:
        stopped = True
        forging.join()
    assert "hung" in again.exit_reason


@pytest.mark.parametrize("incarnation", [0, 2, 1000, 2**63 - 1])
def test_a_status_of_a_run_that_does_not_live_is_not_shown(system: System, raw: Raw, incarnation: int) -> None:
    system.client.components()
    for _ in range(20):
        raw.say(system.client.keys.status("sink"), _status("sink", incarnation), "sink", 1)
    wait_until(lambda: (age := system.client.components()["sink"].age) is not None and age < 1.0)
    shown = system.client.components()["sink"]
    assert shown.status is not None
    assert shown.status.incarnation == 1
    assert shown.status.state is State.ACTIVE


def test_forged_names_fill_no_list(system: System, raw: Raw) -> None:
    for number in range(3000):
        name = f"ghost-{number}"
        raw.say(system.client.keys.status(name), _status(name, 1), name)
    assert sorted(system.client.components()) == ["hanging", "sink", "source"]


def test_a_token_that_names_no_run_confuses_nobody(system: System, raw: Raw) -> None:
    tokens = [
        raw.token(f"tests/component/{name}/alive/{run}")
        for name, run in (("sink", "abc"), ("sink", "-1"), ("sink", "1.5"), ("sink", "x"), ("ghost", "abc"))
    ]
    with stranger(system.info) as other:
        key = "tests/component/*/alive/*"
        wait_until(lambda: len(list(other.session.liveliness().get(key, timeout=1.0))) == 3 + len(tokens))
    assert system.client.view("sink").incarnation == 1
    assert "sink" in system.client.components()
    for token in tokens:
        token.undeclare()
    assert system.client.view("sink").incarnation == 1
    assert system.processes()["sink"].incarnation == 1


def test_a_forged_host_status_is_corrected_by_the_host(system: System, raw: Raw) -> None:
    process = ProcessStatus("sink", 77, ProcessState.QUARANTINED)
    key, forged = system.client.keys.host("local", "status"), HostStatus("local", 1e9, 1, (process,))

    def believed() -> bool:
        raw.say(key, forged, "host-local")
        return system.processes()["sink"] == process

    wait_until(believed, "the forged status to be believed")
    wait_until(lambda: sorted(system.processes()) == ["hanging", "sink", "source"], "the host to correct it")
    assert system.processes()["sink"].incarnation == 1


CHANGES = {
    "transition": SetTransition(Transition.DEACTIVATE),
    "parameters": ParameterValues({"delay": 0.5}),
    "connections": Rewire(RewireStep.OPEN, "numbers", "elsewhere"),
    "state": StateRequest(StateStep.RESTORE, {"heard": 1}, 1),
}


def test_control_of_a_run_that_has_ended_reaches_nobody(start: Start) -> None:
    system = _up(start)
    _hang(system)
    system.wait_running("hanging", 2)
    wait_until(lambda: system.client.view("hanging").state is State.ACTIVE)
    before = system.client.view("hanging")
    with stranger(system.info) as raw:
        for verb, change in CHANGES.items():
            for incarnation in (0, 1, 3):
                assert not raw.ask(system.client.keys.control("hanging", incarnation, verb), codec.encode(change), 0.3)
    assert system.client.view("hanging") == before


def _detail(system: System, name: str) -> str:
    status = system.client.components()[name].status
    return status.detail if status else ""


@pytest.fixture(scope="module")
def managed(start_for_all: Start) -> System:
    return _managed(start_for_all)


def _managed(start: Start) -> System:
    system = start(SOURCE + SINK + MANAGER)
    for name in ("source", "sink", "adaptation_manager"):
        system.wait_running(name)
    wait_until(lambda: _detail(system, "adaptation_manager").endswith("term 1"), "a manager in charge")
    return system


@pytest.mark.parametrize("verb", CHANGES)
def test_a_change_of_a_component_without_the_managers_term_is_fenced(managed: System, verb: str) -> None:
    with stranger(managed.info) as raw:
        before = managed.client.view("sink")
        for term in (None, 0):
            plain = {**codec.to_plain(CHANGES[verb]), "term": term}
            ((is_error, answer),) = raw.ask(managed.client.keys.control("sink", 1, verb), codec.pack_plain(plain))
            assert is_error
            assert codec.decode(answer, ControlError).code is ControlCode.FENCED
        assert managed.client.view("sink") == before


def test_a_host_takes_no_orders_without_the_managers_term(managed: System) -> None:
    host, before = managed.client.keys, managed.processes()
    spec = managed.client.host_view("local").specs[0]
    orders: dict[str, list[StopComponent] | list[StartComponent] | list[UpdateSpecs]] = {
        "stop": [StopComponent("sink", 0.0, term) for term in (None, 0)],
        "start": [StartComponent("sink", 5, term) for term in (None, 0)],
        "specs": [UpdateSpecs(99, (spec,), (), term) for term in (None, 0)],
    }
    with stranger(managed.info) as raw:
        for verb, messages in orders.items():
            for message in messages:
                ((is_error, answer),) = raw.ask(host.host("local", verb), codec.encode(message))
                error = codec.decode(answer, ControlError)
                assert is_error
                assert error.code is ControlCode.FENCED
                assert "term" in error.problems[0]
    assert {n: (p.pid, p.incarnation) for n, p in managed.processes().items()} == {
        n: (p.pid, p.incarnation) for n, p in before.items()
    }


@pytest.mark.parametrize("name", ["nobody", "", "../host", "sink/../source", "*", "sink\0", "сink"])
def test_a_host_asked_for_a_component_that_it_has_not_says_so(managed: System, name: str) -> None:
    term = managed.client.host_view("local").term
    with stranger(managed.info) as raw:
        for verb, message in (("stop", StopComponent(name, 0.0, term)), ("start", StartComponent(name, None, term))):
            ((is_error, answer),) = raw.ask(managed.client.keys.host("local", verb), codec.encode(message))
            assert is_error
            assert f"no component {name!r} on host" in codec.decode(answer, ControlError).problems[0]
        plain = {"component": name, "lines": 10}
        ((is_error, answer),) = raw.ask(managed.client.keys.host("local", "logs"), codec.pack_plain(plain))
        if name == "nobody":
            assert not is_error
        else:
            assert "cannot name a component" in codec.decode(answer, ControlError).problems[0]


def test_an_incarnation_beyond_all_numbers_is_refused(start: Start) -> None:
    managed = _managed(start)
    term = managed.client.host_view("local").term
    key = managed.client.keys.host("local", "start")
    stop = codec.encode(StopComponent("sink", 1.0, term))
    with stranger(managed.info) as raw:
        raw.ask(managed.client.keys.host("local", "stop"), stop)
        managed.wait_for("sink", lambda p: p.state is ProcessState.STOPPED, "stopped")
        ((is_error, answer),) = raw.ask(key, codec.encode(StartComponent("sink", 2**63, term)))
        assert is_error
        assert "incarnation" in codec.decode(answer, ControlError).problems[0]
        ((is_error, _),) = raw.ask(key, codec.encode(StartComponent("sink", None, term)))
        assert not is_error
    managed.wait_running("sink", 2)
