"""Systems in a home of their own."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.host.several import Site
from tests.support.systems import System, all_ended, home

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
def start(tmp_path: Path) -> Iterator[Start]:
    """Return what starts a system of the given components (YAML); all are ended with the test."""
    with home(tmp_path / "home"), all_ended() as started:

        def run(components: str, *options: str) -> System:
            stack = tmp_path / "stack.yaml"
            stack.write_text(HEAD + components)
            started.append(System(stack, *options))
            return started[-1]

        yield run


@pytest.fixture
def site(tmp_path: Path) -> Iterator[Site]:
    """Return a site in a home of its own."""
    with home(tmp_path / "home"):
        made = Site(tmp_path)
        yield made
        made.close()
