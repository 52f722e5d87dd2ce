"""Systems in a home of their own, beside which something hostile happens."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.host.system import System, children_of, exists

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
def start(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Start]:
    """Return what starts a system of the given components; with the test, each ends and leaves nothing."""
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path / "home"))
    started: list[System] = []

    def run(components: str, *options: str, head: str = HEAD) -> System:
        system = System(_write(tmp_path, components, head), *options)
        started.append(system)
        return system

    yield run
    for system in started:
        _end(system)


@pytest.fixture(scope="module")
def start_for_all(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Start]:
    """Return what starts a system that tests of a module share, in a home of its own: none of them may harm it."""
    started: list[System] = []

    def run(components: str, *options: str, head: str = HEAD) -> System:
        folder = tmp_path_factory.mktemp("shared")
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("REGRAFT_HOME", str(folder / "home"))
            system = System(_write(folder, components, head), *options)
        started.append(system)
        return system

    yield run
    for system in started:
        _end(system)
