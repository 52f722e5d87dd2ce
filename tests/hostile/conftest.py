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


@pytest.fixture
def stack(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], Path]:
    """Return what writes a stack file of the given components (YAML)."""
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path / "home"))

    def write(components: str, head: str = HEAD) -> Path:
        path = tmp_path / "stack.yaml"
        path.write_text(head + components)
        return path

    return write


@pytest.fixture
def start(stack: Callable[..., Path]) -> Iterator[Start]:
    """Return what starts a system of the given components; with the test, each ends and leaves nothing."""
    started: list[System] = []

    def run(components: str, *options: str, head: str = HEAD) -> System:
        system = System(stack(components, head), *options)
        started.append(system)
        return system

    yield run
    for system in started:
        processes = children_of(system.process.pid)
        system.end()
        assert not [pid for pid in processes if exists(pid)]
