"""What counts as silence of a loop."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from regraft.host.watchdog import hang_detection, proc_stats
from regraft.host.watchdog.hang_detection import HUNG_TIMEOUT, Watchdog
from regraft.host.watchdog.memory_use import resident_size

STEP = 0.05


def _hung_after(
    taken_a_second: float,
    monkeypatch: pytest.MonkeyPatch,
    *,
    on_disk_for: float = 0.0,
    loop_waits: float = 0.0,
    crowding: float = 1.0,
) -> float:
    """Return the seconds after which a silent loop is found while processors, or the disk, are taken from it.

    ``loop_waits`` is the share of its time for which its thread waits for a processor, ``crowding`` how many threads
    want each.
    """
    monkeypatch.setattr(hang_detection, "crowding", lambda: crowding)
    now, watched = 100.0, Watchdog()
    monkeypatch.setattr(proc_stats, "stolen", lambda: (now - 100.0) * taken_a_second)
    monkeypatch.setattr(proc_stats, "processor_wait", lambda pid, standing: {"1": (now - 100.0) * loop_waits})
    monkeypatch.setattr(proc_stats, "waits_for_disk", lambda pid: now - 100.0 < on_disk_for)
    watched.watch("loop/1", os.getpid(), 0.3, now)
    while not watched.hung(now, None):
        now += STEP
    return now - 100.0


def test_time_that_was_taken_from_the_machine_is_nobodys_silence(monkeypatch: pytest.MonkeyPatch) -> None:
    assert HUNG_TIMEOUT <= _hung_after(0.0, monkeypatch) <= HUNG_TIMEOUT + 2 * STEP
    assert _hung_after(0.8, monkeypatch) > 2 * HUNG_TIMEOUT


def test_a_hung_loop_is_found_on_a_machine_that_gets_no_time_at_all(monkeypatch: pytest.MonkeyPatch) -> None:
    assert _hung_after(1.5, monkeypatch) < hang_detection.MAX_FORGIVEN_OF_ONE + HUNG_TIMEOUT + 1.0


def test_a_loop_that_the_machine_keeps_from_running_is_slow_and_not_hung(monkeypatch: pytest.MonkeyPatch) -> None:
    assert _hung_after(0.0, monkeypatch, loop_waits=0.9) > 4 * HUNG_TIMEOUT
    assert _hung_after(0.0, monkeypatch, loop_waits=0.9) < 12 * HUNG_TIMEOUT
    assert _hung_after(0.0, monkeypatch, loop_waits=1.0) < hang_detection.MAX_FORGIVEN_OF_ONE + HUNG_TIMEOUT + 1.0


def test_a_handler_gets_as_much_of_a_processor_beside_others_as_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside five others a loop runs for a sixth of the time, from its last heartbeat on."""
    ran = _hung_after(0.0, monkeypatch, loop_waits=5 / 6, crowding=6.0) / 6
    assert HUNG_TIMEOUT - STEP <= ran <= HUNG_TIMEOUT + STEP


def test_a_loop_that_hangs_after_it_has_waited_for_the_disk_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    assert 3.0 < _hung_after(0.0, monkeypatch, on_disk_for=3.0) <= 3.0 + HUNG_TIMEOUT + 2 * STEP


def test_whoever_waits_for_the_disk_for_ever_is_hung(monkeypatch: pytest.MonkeyPatch) -> None:
    longest = hang_detection.MAX_FORGIVEN_ON_DISK
    assert longest < _hung_after(0.0, monkeypatch, on_disk_for=1000.0) < longest + 1.0


def test_the_waits_of_whoever_is_on_the_way_of_many_are_read_once(monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[int] = []

    def waited(pid: int, standing: object) -> proc_stats.Waits:
        read.append(pid)
        return {}

    monkeypatch.setattr(proc_stats, "processor_wait", waited)
    watched = Watchdog()
    for number in range(50):
        watched.watch(f"loop_{number}/1", 1_000_000 + number, HUNG_TIMEOUT, 0.0)
    watched.hung(0.0, None)
    watched.hung(hang_detection.CLOSER_LOOK_TIMEOUT, None)
    assert sorted(read) == sorted({os.getpid(), *range(1_000_000, 1_000_050)})


def test_a_wait_for_a_processor_that_lasts_is_seen_before_it_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    runnable = True
    monkeypatch.setattr(proc_stats, "_wants_to_run", lambda task: runnable)
    standing = proc_stats.OpenWaits()
    waited = []
    for look in range(4):
        standing.now = 0.5 * look
        waited.append(standing.seconds("1/1", ran=100, waited=7))
    assert waited == [0.0, 0.5, 1.0, 1.5]
    assert standing.seconds("1/1", ran=101, waited=7 + 1_500_000_000) == 0.0, "it has run, and the kernel counts it"
    runnable = False
    standing.now = 9.0
    assert standing.seconds("1/1", ran=101, waited=7 + 1_500_000_000) == 0.0, "it sleeps"


NAMED = r"""
import ctypes, sys
ctypes.CDLL(None).prctl(15, b"d\xc3\xa9tecteur_cam\xc3")
print("named", flush=True)
sys.stdin.read()
"""
"""A name of 15 bytes, as the kernel keeps it of one that is longer: it ends within a character."""


def test_a_process_whose_name_is_no_text_is_watched_like_any_other() -> None:
    with subprocess.Popen([sys.executable, "-c", NAMED], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as named:
        assert named.stdout is not None
        assert named.stdout.readline() == b"named\n"
        assert resident_size(named.pid) > 0.0
        assert not proc_stats.waits_for_disk(named.pid)
        assert proc_stats.processor_wait(named.pid)
        named.communicate(b"")
