"""Decisions taken by planners that run as processes, some of which are killed."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from regraft import CallFailed
from regraft.bus_schema.messages.planning import Proposal, ProposalRequest
from regraft.bus_schema.model.adaptation import Outcome, SetParameters
from regraft.bus_schema.model.lifecycle import State
from tests.support.machine.processes import kill
from tests.support.systems import System, home
from tests.support.waiting import wait_until

pytestmark = pytest.mark.slow

HERE = Path(__file__).parents[1]
PLANNERS = "regraft.adaptation_manager.planners"
STACK = f"""\
system: tests
clock: real
topics:
  adaptations: {{type: regraft/AdaptationReport}}
  architecture: {{type: regraft/Architecture}}
components:
  motor: {{class: 'tests.planners.motor:Motor'}}
  adaptation_manager: {{class: 'regraft.adaptation_manager.manager:AdaptationManager'}}
  forecast: {{class: '{PLANNERS}.forecast.forecast_planner:ForecastPlanner', parameters: {{decisions: pace}}}}
  bandits: {{class: '{PLANNERS}.bandits.bandit_planner:BanditPlanner', parameters: {{decisions: other/turn.yaml}}}}
"""
PACE = """\
context:
  gear: {topic: architecture, field: components.motor.parameters.gear}
choices:
  speed: {component: motor, parameter: speed, values: [1.0, 2.0, 3.0]}
objective: {utility: motor.work - 0.15 * motor.wear}
triggers: {every: 0.3}
"""
PARTS = """\
context:
  need: {request: need}
  quiet: {request: quiet}
choices:
  spare:
    alternatives:
      none: {set: {component: spare, present: false}, figures: {help: 0}}
      turning:
        figures: {help: 1}
        set:
          - {component: spare, present: {class: 'tests.planners.motor:Motor'}}
          - {component: spare, parameter: speed, value: 4.0}
      resting:
        figures: {help: 0.5}
        set: [{component: spare, present: {class: 'tests.planners.motor:Motor'}}, {component: spare, state: inactive}]
  engine: {component: motor, classes: ['tests.planners.motor:Motor', 'tests.planners.motor:StrongMotor']}
constraints: [{require: spare != 'resting' or need < 0.5}]
qualities: {work: motor.work}
objective: {utility: "need * total.help + need * work", bounds: {}}
faults:
  noise: {when: quiet > 0.5, excludes: {spare: turning}, prescribes: {spare: resting}}
"""
TURN = """\
choices:
  speed: {component: motor, parameter: speed, values: [1.0, 2.0]}
  gear: {component: motor, parameter: gear, values: [1, 2]}
constraints: [{forbid: {speed: 1.0, gear: 1}}]
objective: {utility: 0.5}
"""


FILES = {"stack.yaml": STACK, "pace/pace.yaml": PACE, "pace/parts.yaml": PARTS, "other/turn.yaml": TURN}


@pytest.fixture(scope="module")
def system(tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    folder = tmp_path_factory.mktemp("decisions")
    for name, text in FILES.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text)
    with home(folder / "home"):
        system = System(folder / "stack.yaml")
        yield system
        system.end()


def speed(system: System) -> Any:
    """Return the speed that should be, None while nobody can be asked."""
    with suppress(CallFailed):
        return system.client.architecture().components["motor"].parameters.get("speed", 1.0)
    return None


def slowed(system: System) -> bool:
    """Set the speed against the decision; return whether that was applied."""
    with suppress(CallFailed):
        report = system.client.adapt(SetParameters("motor", {"speed": 1.0}), reason="by hand")
        return report.outcome is Outcome.APPLIED
    return False


def test_a_planner_takes_its_decision_again_and_again_whoever_was_killed(system: System) -> None:
    wait_until(lambda: speed(system) == 3.0, "the first decision")
    for victim in ("forecast", "adaptation_manager", "motor"):
        process = system.wait_running(victim)
        assert process.pid
        kill(process.pid)
        system.wait_running(victim, process.incarnation + 1)
        wait_until(lambda: slowed(system), "somebody to set the speed")
        wait_until(lambda: speed(system) == 3.0, f"the decision after {victim} was killed")


def test_a_decision_adds_exchanges_and_removes_components(system: System) -> None:
    def decide(**context: float) -> Proposal:
        request = ProposalRequest("parts", inputs={"decision": "parts"}, context={"quiet": 0.0, **context})
        return system.client.call("planners/forecast/propose", request, Proposal, 60.0)

    system.wait_running("forecast")
    more = decide(need=1.0)
    assert more.choice["outcome"] == "applied", more.choice
    components = system.client.architecture().components
    assert components["spare"].parameters == {"speed": 4.0}
    assert components["motor"].cls == "tests.planners.motor:StrongMotor"
    assert more.choice["predicted"]["work"]["after"] == 2 * more.choice["predicted"]["work"]["before"]
    quiet = decide(need=0.2, quiet=1.0)
    assert quiet.choice["outcome"] == "applied", quiet.choice
    assert system.client.architecture().components["spare"].state is State.INACTIVE
    less = decide(need=-1.0)
    assert less.choice["outcome"] == "applied", less.choice
    components = system.client.architecture().components
    assert "spare" not in components
    assert components["motor"].cls == "tests.planners.motor:Motor"


def test_a_planner_reads_only_the_decisions_that_it_was_given(system: System) -> None:
    system.wait_running("bandits")
    request = ProposalRequest("turn", inputs={"decision": "turn"}, apply=False)
    proposal = system.client.call("planners/bandits/propose", request, Proposal, 30.0)
    assert proposal.choice["options"] == 3
