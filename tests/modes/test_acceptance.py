"""A laser fails and recovers: its system degrades and returns, as the rules say, whoever is killed on the way."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from regraft import CallFailed, run_directory
from regraft.bus_schema.messages.management.manager import ArchitectureRequest, JournalPage, JournalRequest
from regraft.bus_schema.messages.management.modes import MODES, ModesRequest, PartModes, SystemModes
from regraft.bus_schema.messages.protocol.host import ProcessState
from regraft.bus_schema.model.adaptation import ARCHITECTURE, JOURNAL
from regraft.bus_schema.model.architecture import Architecture
from tests.modes.parts import RECOVERS_AFTER
from tests.modes.stacks import REAL, write
from tests.modes.wholes import whole_modes
from tests.support.commands import in_home, run
from tests.support.systems import System
from tests.support.waiting import PATIENCE, slowness, wait_until

pytestmark = pytest.mark.slow

TICKS_A_SECOND = 20


def _run(folder: Path) -> dict[str, Any]:
    folder.mkdir()
    done = run("up", str(write(folder)), "--headless", "--json", "--for", "8", environment=in_home(folder / "home"))
    assert done.stdout, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    return found


@pytest.mark.parametrize("number", [3, pytest.param(10, marks=pytest.mark.evidence)])
def test_it_degrades_within_half_a_second_and_returns_and_all_runs_are_one(tmp_path: Path, number: int) -> None:
    runs = [_run(tmp_path / str(each)) for each in range(number)]
    assert all(found["reproducible"] for found in runs), runs
    assert len({found["digest"] for found in runs}) == 1, runs
    entered = sorted((int(tick), mode) for mode, _, tick in (w.partition(" ") for w in runs[0]["visits"]) if tick)
    assert [mode for _, mode in entered] == ["degraded", "normal", "degraded", "normal"]
    failed, recovered = 1.0 * TICKS_A_SECOND, 2.5 * TICKS_A_SECOND
    assert failed < entered[0][0] <= failed + 0.5 * TICKS_A_SECOND
    assert recovered < entered[1][0] <= recovered + 0.5 * TICKS_A_SECOND


@pytest.fixture
def system(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[System]:
    """The system under the real clock; a failure lasts the longer, the slower the machine is."""
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path / "home"))
    lasting = f"recovers_after: {RECOVERS_AFTER * slowness():.1f}, failures: 1000"
    made = System(write(tmp_path, REAL.replace("failures: 1000", lasting)))
    yield made
    made.end()


def _system_part(system: System) -> PartModes | None:
    try:
        found = system.client.call(MODES, ModesRequest(), SystemModes, PATIENCE)
    except CallFailed:
        return None
    return found.part("")


def _is_whole(system: System, mode: str) -> bool:
    part = _system_part(system)
    return part is not None and (part.target, part.actual, part.as_asked) == (mode, mode, True)


def _no_revision_was_half_a_mode(system: System) -> None:
    """Look at every architecture that the journal has: each is all of one mode, and nothing of the other."""
    page = system.client.call(JOURNAL, JournalRequest(), JournalPage, PATIENCE)
    assert not [line for line in page.entries if line.outcome.value == "stuck"], page.entries
    for revision in sorted({line.revision_after for line in page.entries}):
        found = system.client.call(ARCHITECTURE, ArchitectureRequest(revision), Architecture, PATIENCE)
        fitting = whole_modes(found)
        assert len(fitting) == 1, (revision, found)
        assert found.asked_modes in ({}, {"": fitting[0]})


def test_it_degrades_and_returns_under_the_real_clock(system: System) -> None:
    wait_until(lambda: _is_whole(system, "degraded"), "degraded")
    wait_until(lambda: _is_whole(system, "normal"), "normal")
    _no_revision_was_half_a_mode(system)
    wait_until(lambda: _failures(system), "a failure of the laser and its end")
    failed, recovered = _failures(system)[0]
    applied = [each.stamp for each in system.events if each.kind == "adaptation.applied"]
    assert any(failed < stamp < recovered for stamp in applied), (failed, applied, recovered)


def _failures(system: System) -> list[tuple[float, float]]:
    """Return when the laser failed and when each failure was over, of those that were heard of as a whole."""
    failed = [each.stamp for each in system.said("component.failed", "laser")]
    recovered = [each.stamp for each in system.said("component.recovered", "laser")]
    return list(zip(failed, [stamp for stamp in recovered if failed and stamp > failed[0]], strict=False))


def _wait_for_another(system: System, victim: str, pid: int) -> None:
    system.wait_for(victim, lambda p: p.state is ProcessState.RUNNING and p.pid not in (0, pid), "running again")


VICTIMS = ("adaptation_manager", "mode_planner", "laser")


@pytest.mark.parametrize("victim", VICTIMS)
def test_whoever_is_killed_at_whichever_step_there_is_never_half_a_mode(system: System, victim: str) -> None:
    kills = run_directory.folder("tests") / "kills"
    for step in ("driver set", "lamp activate", "laser configure", "laser activate", "lamp deactivate"):
        pid = system.wait_running(victim).pid
        kills.write_text(f"{step} {pid}")
        wait_until(lambda: not kills.exists(), f"{step}, at which {victim} is killed")
        _wait_for_another(system, victim, pid)
        wait_until(
            lambda: any(_is_whole(system, mode) for mode in ("normal", "degraded")), f"a whole mode after {step}"
        )
        _no_revision_was_half_a_mode(system)
