"""Systems in a home of their own, beside which something hostile happens."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.support.machine.processes import children_of, exists
from tests.support.systems import System, all_ended, home

Start = Callable[..., System]

HEAD = """\
system: tests
clock: real
imports: [tests.hostile.parts]
topics:
  numbers: {type: hostile_tests/Number, writers: many}
  adaptations: {type: regraft/AdaptationReport}
  architecture: {type: regraft/Architecture}
components:
"""
SOURCE = "  source: {class: 'tests.hostile.parts:Source'}\n"
SINK = "  sink: {class: 'tests.hostile.parts:Sink'}\n"


def _write(folder: Path, components: str, head: str) -> Path:
    path = folder / "stack.yaml"
    path.write_text(head + components)
    return path


def _end(system: System) -> None:
    processes = children_of(system.process.pid)
    system.end()
    assert not [pid for pid in processes if exists(pid)]


@pytest.fixture
def stack(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Path]:
    """Return what writes a stack file of the given components (YAML)."""
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path / "home"))
    return lambda components, head=HEAD: _write(tmp_path, components, head)


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    """Return what starts a system of the given components; with the test, each ends and leaves nothing."""
    with home(tmp_path / "home"), all_ended(_end) as started:

        def run(components: str, *options: str, head: str = HEAD) -> System:
            started.append(System(_write(tmp_path, components, head), *options))
            return started[-1]

        yield run


@pytest.fixture(scope="module")
def start_for_all(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Start]:
    """Return what starts a system that tests of a module share, in a home of its own: none of them may harm it."""
    with all_ended(_end) as started:

        def run(components: str, *options: str, head: str = HEAD) -> System:
            folder = tmp_path_factory.mktemp("shared")
            with home(folder / "home"):
                started.append(System(_write(folder, components, head), *options))
            return started[-1]

        yield run
