"""The end of a run names each reason for which it was no good one."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

from regraft.bus.memory_bus import MemoryBus, MemoryHub
from regraft.bus_schema.model.architecture import Architecture
from regraft.cli.system.closing import Closing
from regraft.cli.system.display import Quiet
from regraft.cli.system.running import Run
from regraft.host.plan import HostPlan
from regraft.process.shutdown import ShutdownRequest
from regraft.run_directory import RunInfo
from regraft.system.launch import Running


def last_look(tmp_path: Path, *, ended: bool) -> tuple[Closing, bool]:
    """Return how a run of no components ends, and whether well."""
    folder = tmp_path / "tests"
    plan = HostPlan(
        architecture=Architecture("tests", 1, False, {}, {}),
        folder=folder,
        stack_folder=tmp_path,
        run="1",
        endpoint="",
        secret="",
    )
    nobody = SimpleNamespace(processes=())
    host: Any = SimpleNamespace(
        plan=plan, ended=ended, processes={}, status=lambda: nobody, others=SimpleNamespace(processes=lambda: ())
    )
    info = RunInfo("tests", "1", 1, "", "stack.yaml", False)
    run = Run(Quiet(), None)
    run.step(Running(host, MemoryBus(MemoryHub()), info, ShutdownRequest()))
    assert run.closing is not None
    return run.closing, run.healthy


def test_the_end_of_what_starts_the_processes_is_a_problem_of_the_run(home: Path) -> None:
    closing, healthy = last_look(home, ended=True)
    assert not healthy
    (problem,) = closing.plain()["problems"]
    assert problem in closing.line()


def test_a_run_that_somebody_ends_has_no_problem(home: Path) -> None:
    closing, healthy = last_look(home, ended=False)
    assert (closing.problems, healthy) == ((), True)
