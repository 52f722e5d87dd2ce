"""What the host promises about the processes in its care."""

from __future__ import annotations

import contextlib
import os
import stat
import subprocess
import sys
from collections.abc import Iterator

import pytest

from regraft import CallFailed, run_directory
from regraft.bus_schema.messages.protocol.control import Snapshot
from regraft.bus_schema.messages.protocol.host import ProcessState
from regraft.process.logs import MAX_LOG_SIZE
from tests.host.conftest import HEAD, Start
from tests.host.parts import Tick
from tests.support.machine.processes import children_of, exists, go_on, kill, parent_of, stop, wait_gone
from tests.support.paths import ROOT
from tests.support.systems import System, all_ended, home
from tests.support.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.slow

TICKER = "  ticker: {class: 'tests.host.parts:Ticker'}\n"
MOODY = "  moody: {class: 'tests.host.parts:Moody'}\n"
TOGETHER = """\
  tidy: {class: 'tests.host.parts:Tidy'}
  stalling: {class: 'tests.host.parts:Stalling'}
  deaf: {class: 'tests.host.parts:Deaf'}
  dying: {class: 'tests.host.parts:Stillborn', restart: {limit: 3, window: 30, backoff: 0.01}}
  never:
    class: tests.host.parts:Moody
    services: {hang: never/hang, spin: never/spin, stop: never/stop, exit: exit_never}
    restart: never
  failing:
    class: tests.host.parts:Moody
    services: {hang: failing/hang, spin: failing/spin, stop: failing/stop, exit: exit_failing}
    restart: {when: on_failure}
  beeper: {command: [sh, -c, 'echo $REGRAFT_ASSIGNMENT; exec sleep 1000'], managed: false}
  ghost: {command: [no-such-program], managed: false, restart: {limit: 1, backoff: 0.01}}
  nest: {command: [sh, -c, 'sleep 1000 & sleep 1000 & wait'], managed: false}
"""


@pytest.fixture(scope="module")
def system(tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    """Return a system of components that do not disturb each other, each for one test."""
    folder = tmp_path_factory.mktemp("supervised")
    (folder / "stack.yaml").write_text(HEAD + TICKER + MOODY + TOGETHER)
    with home(folder / "home"), all_ended() as started:
        started.append(System(folder / "stack.yaml"))
        yield started[0]


def _ask(system: System, name: str, service: str, count: int = 0) -> None:
    system.ask_until_it_ends(name, lambda: system.client.call(service, Tick(count), Tick, 0.2))


# --- systems of their own ---


def test_whoever_holds_the_interpreter_in_c_code_keeps_its_link(start: Start) -> None:
    system = start(TICKER + "  deep: {class: 'tests.host.parts:Deep'}\n")
    system.wait_running("deep")
    call = system.client.call
    wait_until(lambda: call("heard", Tick(0), Tick, PATIENCE).count > 10)
    assert call("sink", Tick(2000), Tick, PATIENCE) == Tick(2000)
    assert call("missing", Tick(0), Tick, PATIENCE) == Tick(0)
    assert system.processes()["deep"].incarnation == 1


def test_nothing_is_left_when_the_system_ends(start: Start) -> None:
    system = start(TICKER + MOODY + "  stubborn: {class: 'tests.host.parts:Stubborn'}\n")
    for name in ("ticker", "moody", "stubborn"):
        system.wait_running(name)
    pids = children_of(system.process.pid)
    assert len(pids) == 4
    assert system.end() == 0
    assert not [pid for pid in pids if exists(pid)]


def test_nothing_is_left_when_the_host_is_killed(start: Start) -> None:
    system = start(TICKER + MOODY)
    pids = children_of(system.process.pid)
    stop(system.wait_running("moody").pid)
    pids = children_of(system.process.pid)
    system.process.kill()
    wait_gone(pids)


def test_a_system_whose_zygote_is_killed_ends_with_an_error_and_leaves_nothing(start: Start) -> None:
    system = start(TICKER + MOODY)
    system.wait_running("ticker")
    pids = children_of(system.process.pid)
    zygote = next(pid for pid in pids if len(children_of(pid)) == len(pids) - 1)
    kill(zygote)
    assert system.process.wait(PATIENCE) != 0
    wait_gone(pids)


DAEMON = """  nest:
    command: [sh, -c, "setsid sh -c 'sleep 1000 & echo daemon $!'; exec sleep 1000"]
    managed: false
    restart: never
"""


@pytest.mark.parametrize("ends", ["the program", "the system", "the host", "the zygote"])
def test_what_a_program_has_daemonised_ends_too(start: Start, ends: str) -> None:
    system = start(DAEMON + TICKER)
    nest = system.wait_running("nest").pid
    wait_until(lambda: any(line.startswith("daemon ") for line in system.client.logs("nest")), "the daemon")
    daemon = next(int(line.split()[1]) for line in system.client.logs("nest") if line.startswith("daemon "))
    (zygote,) = [pid for pid in children_of(system.process.pid) if nest in children_of(pid)]
    assert exists(daemon)
    if ends == "the program":
        kill(nest)
    elif ends == "the system":
        assert system.end() == 0
        assert not exists(daemon)
    else:
        kill(system.process.pid if ends == "the host" else zygote)
    wait_gone([daemon, nest])


def test_what_a_module_starts_while_it_is_imported_ends_with_the_system(start: Start) -> None:
    system = start("  forking: {class: 'tests.host.processes.forking:Forking'}\n")
    system.wait_running("forking")
    before = [pid for pid in children_of(system.process.pid) if exists(pid)]
    assert system.end() == 0
    assert not [pid for pid in before if exists(pid)]


CHATTY = """  chatty:
    command: [sh, -c, "while sleep 0.01; do head -c 1000000 /dev/zero | tr '\\\\0' x; echo; done"]
    managed: false
"""


def test_the_log_of_the_host_stays_bounded(start: Start) -> None:
    start("  sleeper: {command: [sleep, '1000'], managed: false}\n").wait_running("sleeper")
    log = run_directory.folder("tests") / "logs" / "host.log"
    with log.open("ab") as file:
        file.write(b"x" * (MAX_LOG_SIZE + 1))
    wait_until(lambda: log.stat().st_size < MAX_LOG_SIZE, "the log to begin anew")
    assert log.with_name("host.log.1").exists()


def test_a_log_stays_bounded_while_its_component_writes(start: Start) -> None:
    system = start(CHATTY)
    system.wait_running("chatty")
    log = run_directory.folder("tests") / "logs" / "chatty.log"
    kept = log.with_name("chatty.log.1")
    wait_until(lambda: kept.exists() and log.stat().st_size > MAX_LOG_SIZE // 2, "the log to grow after it began anew")
    assert kept.read_bytes()[:1000] == b"x" * 1000
    assert kept.stat().st_size <= 2 * MAX_LOG_SIZE
    assert stat.S_IMODE(kept.stat().st_mode) == 0o600
    before = kept.stat().st_mtime_ns
    wait_until(lambda: kept.stat().st_mtime_ns != before, "it to begin anew again")


def test_a_hung_process_may_write_where_it_hangs_however_late_the_signal_to_do_so_comes(start: Start) -> None:
    system = start(TICKER + MOODY)
    zygote = parent_of(system.wait_running("moody").pid)
    system.wait_running("ticker")

    def hangs() -> bool:
        with contextlib.suppress(CallFailed):
            system.client.call("hang", Tick(0), Tick, 0.2)
        return bool(system.said("component.hung", "moody"))

    stop(zygote)
    try:
        wait_until(hangs, "it to be found")
        heard = _count(system)
        wait_until(lambda: _count(system) > heard + 100, "twice the time that a kill by force is put off")
    finally:
        go_on(zygote)
    system.wait_running("moody", 2)
    lines = system.client.logs("moody")
    assert any('parts.py", line' in line and line.endswith("in hang") for line in lines), lines


# --- one system for all ---


def test_under_the_real_clock_a_component_is_no_batch_work(system: System) -> None:
    assert os.sched_getscheduler(system.wait_running("ticker").pid) == os.SCHED_OTHER


def test_a_killed_component_comes_back_with_its_state_and_it_is_said(system: System) -> None:
    pid = system.wait_running("ticker").pid
    wait_until(lambda: _count(system) > 20)
    before = _count(system)
    kill(pid)
    again = system.wait_running("ticker", 2)
    assert again.pid != pid
    assert again.exit_reason == "killed by SIGKILL"
    wait_until(lambda: _count(system) > before)
    assert len(system.said("component.restarted", "ticker")) == 1
    begins = [line for line in system.client.logs("ticker") if line.startswith("ticker begins at")]
    assert begins[0] == "ticker begins at 0"
    assert int(begins[1].split()[-1]) >= before - 10


def _count(system: System) -> int:
    snapshot = system.client.control("ticker", "state")
    assert isinstance(snapshot, Snapshot)
    count: int = snapshot.state["count"]
    return count


def test_no_process_stands_still_to_look_through_all_that_was_imported(system: System) -> None:
    system.wait_running("tidy")
    assert system.client.call("garbage", Tick(0), Tick, PATIENCE).count < 10_000
    prepared = "import gc, regraft.system.launch as launch; launch.prepare_process(()); print(len(gc.get_objects()))"
    host = subprocess.run([sys.executable, "-c", prepared], cwd=ROOT, capture_output=True, text=True, check=True)
    assert int(host.stdout) < 10_000


def test_a_hung_loop_is_found_and_restarted_and_its_log_says_where_it_hung(system: System) -> None:
    for incarnation, how in ((2, "hang"), (3, "spin"), (4, "stop")):
        system.wait_running("moody", incarnation - 1)
        _ask(system, "moody", how)
        again = system.wait_running("moody", incarnation)
        assert "hung" in again.exit_reason
        lines = system.client.logs("moody")
        assert any('parts.py", line' in line and line.endswith(f"in {how}") for line in lines), f"{how}: {lines}"
    assert len(system.said("component.hung", "moody")) == 3


def test_a_hung_process_that_ignores_the_signal_is_killed_by_force(system: System) -> None:
    system.wait_running("deaf")
    _ask(system, "deaf", "ignore")
    assert "hung" in system.wait_running("deaf", 2).exit_reason


def test_whoever_waits_for_the_disk_is_not_hung_and_it_is_said(system: System) -> None:
    system.wait_running("stalling")
    stalls = 0
    while len(system.said("component.stalled", "stalling")) < 2:  # a host that is kept from looking sees nothing of it
        assert system.client.call("stall", Tick(2000), Tick, PATIENCE) == Tick(2000)
        stalls += 1
        assert stalls < 15
    told = system.said("component.stalled", "stalling")
    assert len(told) <= stalls
    assert "waits for a disk" in told[0].text
    assert system.processes()["stalling"].incarnation == 1
    assert not system.said("component.hung", "stalling")


def test_a_component_that_keeps_dying_is_quarantined_and_the_others_go_on(system: System) -> None:
    process = system.wait_for("dying", lambda p: p.state is ProcessState.QUARANTINED, "quarantined")
    assert process.exit_reason == "exit code 3"
    assert process.incarnation == 4
    assert "left stopped" in system.said("component.quarantined", "dying")[0].text
    assert any("no life in me" in line for line in system.client.logs("dying"))
    system.wait_running("ticker")


def test_the_restart_policy_is_kept(system: System) -> None:
    system.wait_running("never")
    system.wait_running("failing")
    _ask(system, "never", "exit_never", 5)
    assert system.wait_for("never", lambda p: p.state is ProcessState.STOPPED, "stopped").exit_reason == "exit code 5"
    _ask(system, "failing", "exit_failing", 5)
    system.wait_running("failing", 2)

    def is_left_stopped() -> bool:
        # A request is repeated to a service that has come back, so the one before may have ended another run, too.
        if system.processes()["failing"].state is ProcessState.RUNNING:
            _ask(system, "failing", "exit_failing", 0)
        return system.processes()["failing"].state is ProcessState.STOPPED

    wait_until(is_left_stopped, "failing to be left stopped")


def test_any_program_can_be_a_component(system: System) -> None:
    process = system.wait_running("beeper")
    assert not process.managed
    wait_until(lambda: any('"name": "beeper"' in line for line in system.client.logs("beeper")))
    kill(process.pid)
    system.wait_running("beeper", 2)


def test_a_program_that_does_not_exist_is_quarantined_and_its_log_says_why(system: System) -> None:
    system.wait_for("ghost", lambda p: p.state is ProcessState.QUARANTINED, "quarantined")
    assert any("cannot run 'no-such-program'" in line for line in system.client.logs("ghost"))


def test_what_a_program_started_ends_with_it(system: System) -> None:
    nest = system.wait_running("nest").pid
    wait_until(lambda: len(children_of(nest)) == 2)
    brood = children_of(nest)
    kill(nest)
    wait_gone(brood)
