"""More components than a machine can hold are refused with the arithmetic, and none is started."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest

from regraft import run_directory
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.system import capacity
from regraft.system.capacity import Room, TooMany, room_here
from tests.support.paths import ROOT
from tests.support.waiting import PATIENCE

MIB = 2**20


def _specs(components: int, programs: int = 0) -> list[ComponentSpec]:
    named = [ComponentSpec(f"c{n}", cls="tests.host.parts:Ticker") for n in range(components)]
    return named + [ComponentSpec(f"p{n}", command=("sleep", "9")) for n in range(programs)]


def test_a_dozen_components_fit_into_a_small_machine() -> None:
    capacity.check(_specs(13), Room(memory=512.0, threads=100, files=64))


@pytest.mark.parametrize(
    ("room", "text"),
    [
        (Room(memory=2048.0), "they need 5420 MiB of memory, 9 each, and 2048 MiB are available"),
        (Room(threads=1000), "they need 3620 threads, 6 each, and 1000 may be started"),
        (Room(files=1024), "their host needs 1232 open files, 2 each and 32 more, and may have 1024 (ulimit -n)"),
    ],
)
def test_what_does_not_fit_is_said_with_the_arithmetic(room: Room, text: str) -> None:
    with pytest.raises(TooMany, match="620 components are more than this machine can hold: ") as caught:
        capacity.check(_specs(600, programs=20), room)
    assert str(caught.value).endswith(text)


def test_a_joined_host_needs_files_for_leases_too() -> None:
    room = Room(files=1024)
    capacity.check(_specs(300), room)
    with pytest.raises(TooMany, match="needs 1232 open files, 4 each and 32 more"):
        capacity.check(_specs(300), room, joined=True)


def test_a_stack_that_does_not_fit_is_refused_before_anything_starts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path / "home"))
    names = "".join(f"  c{n}: {{class: 'tests.host.parts:Sleeper'}}\n" for n in range(100))
    (tmp_path / "stack.yaml").write_text(f"system: tests\ncomponents:\n{names}")
    up = f"ulimit -n 100; exec {sys.executable} -m regraft.cli up {tmp_path} --headless"
    ran = subprocess.run(["sh", "-c", up], cwd=ROOT, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert ran.returncode == 2
    said = [line for line in ran.stderr.splitlines() if "takes long" not in line]
    assert said == [
        "regraft: 100 components are more than this machine can hold: their host needs 232 open files, "
        "2 each and 32 more, and may have 100 (ulimit -n)"
    ]
    assert ran.stdout == ""
    assert not list((run_directory.folder("tests") / "logs").glob("c*"))


def _write(folder: Path, **files: str) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        (folder / name.replace("__", ".")).write_text(text)


def _proc(folder: Path, groups: str) -> Path:
    _write(folder, meminfo="MemTotal: 9000000 kB\nMemAvailable: 4096000 kB\nSwapFree: 0 kB\n")
    _write(folder, loadavg="0.1 0.1 0.1 1/400 77\n")
    _write(folder / "sys" / "kernel", pid_max="32768\n")
    (folder / "sys" / "kernel" / "threads-max").write_text("20400\n")
    _write(folder / "self", cgroup=groups)
    return folder


def test_the_room_of_a_machine_is_what_is_free_and_may_be_started(tmp_path: Path) -> None:
    room = room_here(_proc(tmp_path / "proc", "0::/\n"), tmp_path / "groups")
    assert room.memory == 4000.0
    assert room.threads <= 20_000


def test_a_process_whose_name_is_no_text_leaves_the_room_as_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    monkeypatch.setattr(resource, "getrlimit", lambda which: (500, 500))
    proc = _proc(tmp_path / "proc", "0::/\n")
    (proc / "7").mkdir()
    (proc / "7" / "status").write_bytes(b"Name:\td\xc3\nUid:\t1000\t1000\nThreads:\t40\n")
    assert room_here(proc, tmp_path / "groups").threads == 460


def test_the_room_in_a_container_is_what_every_group_around_it_has_left(tmp_path: Path) -> None:
    proc, groups = _proc(tmp_path / "proc", "0::/outer/inner\n"), tmp_path / "groups"
    outer = {"memory__max": f"{600 * MIB}", "memory__current": f"{200 * MIB}"}
    _write(
        groups / "outer",
        memory__stat=f"anon 5\ninactive_file {50 * MIB}\n",
        pids__max="300",
        pids__current="100",
        **outer,
    )
    _write(groups / "outer" / "inner", memory__max="max", memory__current="5", pids__max="max", pids__current="100")
    room = room_here(proc, groups)
    assert (room.memory, room.threads) == (450.0, 200)


def test_the_room_in_a_container_of_the_older_kind(tmp_path: Path) -> None:
    proc, groups = _proc(tmp_path / "proc", "4:memory:/a\n8:cpu,pids:/a\n0::/\n"), tmp_path / "groups"
    stat = f"inactive_file 1\ntotal_inactive_file {10 * MIB}\ntotal_active_file {20 * MIB}\n"
    use = {"memory__limit_in_bytes": f"{600 * MIB}", "memory__usage_in_bytes": f"{200 * MIB}"}
    _write(groups / "memory", memory__stat=stat, **use)
    _write(groups / "pids" / "a", pids__max="150", pids__current="100")
    room = room_here(proc, groups)
    assert (room.memory, room.threads) == (430.0, 50)
