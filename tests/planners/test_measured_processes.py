"""Decisions by measured qualities, taken by processes under simulated time."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from tests.planners.clogging import CLOGGED_AT
from tests.support.commands import in_home, run

STACK = """\
system: tests
clock: simulated
speed: max
topics:
  position: {type: stepped_tests/Reading}
  adaptations: {type: regraft/AdaptationReport}
  architecture: {type: regraft/Architecture}
imports: [tests.stepped.parts]
components:
  world: {class: 'tests.stepped.parts:TinyWorld'}
  pump: {class: 'tests.planners.clogging:Pump'}
  record: {class: 'tests.planners.clogging:Record'}
  adaptation_manager:
    class: regraft.adaptation_manager.manager:AdaptationManager
    parameters: {journal: $RUN/journal.sqlite}
  forecast:
    class: regraft.adaptation_manager.planners.forecast.forecast_planner:ForecastPlanner
    parameters: {decisions: share.yaml}
"""
SHARE = """\
choices:
  share: {component: pump, parameter: share, values: [0.4, 1.0]}
qualities:
  flow: {measured: pump.flow, estimated: pump.flow}
objective: {utility: flow, settle: 0.5}
triggers: {every: 0.5}
"""


def decided(folder: Path) -> dict[str, Any]:
    """Run for four seconds; return what the run says of itself."""
    folder.mkdir()
    (folder / "stack.yaml").write_text(STACK)
    (folder / "share.yaml").write_text(SHARE)
    words = ("up", str(folder / "stack.yaml"), "--headless", "--json", "--for", "4")
    done = run(*words, environment=in_home(folder / "home"))
    assert done.stdout, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def test_a_clogged_pump_is_decided_upon_in_step_and_equal_runs_decide_alike(tmp_path: Path) -> None:
    first, second = decided(tmp_path / "one"), decided(tmp_path / "two")
    assert (first["reproducible"], first["problems"]) == (True, [])
    assert first["digest"] == second["digest"]
    assert f"share 0.4 by 0.1 at {CLOGGED_AT:g} s" in first["visits"]
