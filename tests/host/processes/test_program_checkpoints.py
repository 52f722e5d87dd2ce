"""Programs get their last checkpoint as a file."""

from __future__ import annotations

import json
from pathlib import Path

from regraft import run_directory
from regraft.bus.zenoh_bus import open_bus
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.protocol.control import Snapshot
from regraft.runtime.core.clock import RealClock
from regraft.runtime.data.writers import Identity, Writers
from tests.host.conftest import Start
from tests.support.machine.processes import kill
from tests.support.systems import System
from tests.support.waiting import wait_until

BEEPER = "  beeper: {command: [sh, -c, 'echo $REGRAFT_ASSIGNMENT; exec sleep 1000'], restart: {backoff: 0.01}}\n"


def _assignment(system: System, incarnation: int) -> dict[str, str]:
    """Return what a run of the program was given."""

    def given() -> list[dict[str, str]]:
        return [json.loads(line) for line in system.client.logs("beeper") if line.startswith("{")]

    wait_until(lambda: len(given()) >= incarnation, f"run {incarnation} to begin")
    return given()[incarnation - 1]


def _kill_once_it_is_kept(system: System, snapshot: Snapshot) -> None:
    """Put a checkpoint as the program would, and kill the program when its host must have it."""
    bus = open_bus(system.info.hub)
    keys = Keys("tests")
    writer = Writers(bus, RealClock(), Identity("beeper", snapshot.incarnation, snapshot.incarnation)).open(
        keys.checkpoint("beeper"), type_of(Snapshot).encoding
    )
    try:
        wait_until(lambda: writer.matched, "the host to listen")
        writer.put(codec.encode(snapshot))
        assert bus.query(keys.host("local", "runs"), b"", 2.0)
    finally:
        bus.close()
    run = system.wait_for("beeper", lambda p: p.pid and p.incarnation == snapshot.incarnation, "a process")
    kill(run.pid)


def test_a_program_finds_its_last_checkpoint_beside_its_log_and_no_earlier_one_is_left(start: Start) -> None:
    system = start(BEEPER)
    assert "checkpoint_file" not in _assignment(system, 1)
    logs = run_directory.folder("tests") / "logs"
    for incarnation in (1, 2):
        snapshot = Snapshot("beeper", incarnation, 0.0, 1, {"count": incarnation})
        _kill_once_it_is_kept(system, snapshot)
        file = Path(_assignment(system, incarnation + 1)["checkpoint_file"])
        assert file.parent == logs
        assert codec.decode(file.read_bytes(), Snapshot) == snapshot
    assert len(list(logs.glob("*checkpoint*"))) == 1


def test_a_program_whose_checkpoint_cannot_be_written_starts_without_it(start: Start) -> None:
    system = start(BEEPER)
    _assignment(system, 1)
    in_the_way = run_directory.folder("tests") / "logs" / ".beeper.checkpoint"
    in_the_way.mkdir()
    _kill_once_it_is_kept(system, Snapshot("beeper", 1, 0.0, 1, {"count": 1}))
    assert "checkpoint_file" not in _assignment(system, 2)
    in_the_way.rmdir()
    _kill_once_it_is_kept(system, Snapshot("beeper", 2, 0.0, 1, {"count": 2}))
    assert Path(_assignment(system, 3)["checkpoint_file"]).exists()
