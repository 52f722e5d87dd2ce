"""Systems in a home of their own."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.host.several import Site
from tests.host.system import System

Start = Callable[..., System]

HEAD = """\
system: tests
clock: real
imports: [tests.host.parts]
topics:
  ticks: {type: host_tests/Tick}
components:
"""


@pytest.fixture
def start(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Start]:
    """Return what starts a system of the given components (YAML); all are ended with the test."""
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path / "home"))
    started: list[System] = []

    def run(components: str, *options: str) -> System:
        stack = tmp_path / "stack.yaml"
        stack.write_text(HEAD + components)
        system = System(stack, *options)
        started.append(system)
        return system

    yield run
    for system in started:
        system.end()


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Site]:
    """Return a site in a home of its own."""
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path / "home"))
    made = Site(tmp_path)
    yield made
    made.close()
