"""A system whose estimators depend on each other, and some of which raise, exit or hang."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.systems import System, home

STACK = """\
system: tests
clock: real
topics:
  a: {type: regraft/Twist}
  b: {type: regraft/Twist}
  c: {type: regraft/Twist}
  d: {type: regraft/Twist}
  w: {type: regraft/Twist}
  x: {type: regraft/Twist}
  y: {type: regraft/Twist}
  z: {type: regraft/Twist}
  adaptations: {type: regraft/AdaptationReport}
  architecture: {type: regraft/Architecture}
components:
  source: {class: tests.estimation.parts:Source, connect: {made: a}}
  other: {class: tests.estimation.parts:Source, connect: {made: d}, parameters: {rate: 40.0}}
  first: {class: tests.estimation.parts:Filter, connect: {taken: a, given: b}}
  second: {class: tests.estimation.parts:Filter, connect: {taken: b, given: c}}
  raising: {class: tests.estimation.parts:Raising, connect: {made: w}}
  leaving: {class: tests.estimation.parts:Leaving, connect: {made: x}}
  exiting: {class: tests.estimation.parts:Exiting, connect: {made: y}}
  hanging: {class: tests.estimation.parts:Hanging, connect: {made: z}, state: inactive}
  adaptation_manager:
    class: regraft.adaptation_manager.manager:AdaptationManager
modes:
  slow:
    - {change: set_parameters, component: source, parameters: {rate: 1.0}}
"""


@pytest.fixture(scope="module")
def stack(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the stack's file."""
    file = tmp_path_factory.mktemp("estimators") / "stack.yaml"
    file.write_text(STACK)
    return file


@pytest.fixture(scope="module")
def system(stack: Path) -> Iterator[System]:
    """Run it for all tests of a module."""
    with home(stack.parent / "home"):
        made = System(stack)
        yield made
        made.end()
