"""Two carriers of one kind in one system, each with skills, a metacontroller and an observer of its own."""

from __future__ import annotations

from pathlib import Path

from regraft.adaptation_manager.planners.metacontrol.skills.generators.writing import generated, write_files
from regraft.adaptation_manager.planners.metacontrol.skills.reading import read_skills

PARTS = "tests.metacontrol.patrol.parts"
SKILLS = """\
import "navigation_definitions.skills"

Component controller {
  Configuration active.DEFAULT { FollowPath.max_vel_x: 0.4 },
  Configuration active.SLOW { FollowPath.max_vel_x: 0.1 }
}
Component laser observable { Configuration active }
Component camera observable { Configuration active }

Realization normal of to_navigate {
  Component controller active, Component laser active
  Quality [safety: 0.8, performance: 0.7, energy: 0.5]; context: Default
};
Realization degraded of to_navigate {
  Component controller active.SLOW, Component camera active
  Quality [safety: 0.55, performance: 0.2, energy: 0.45]; context: Default
};
"""
CARRIER = f"""\
model: carrier.xml
topics:
  diagnostics: {{type: regraft/Diagnostic, writers: many}}
  mission: regraft/MissionStatus
components:
  workshop: {{class: '{PARTS}:Workshop'}}
  controller: {{class: '{PARTS}:Controller', state: inactive, parameters: {{kills: $RUN/kills}}}}
  laser: {{class: '{PARTS}:Beacon', state: inactive, parameters: {{kills: $RUN/kills}}}}
  camera: {{class: '{PARTS}:Beacon', state: inactive, parameters: {{kills: $RUN/kills}}}}
  component_observer:
    class: regraft.services.observers.component_observer:ComponentObserver
    parameters: {{observed: observed_components.yaml, presumed_after: 1.0}}
  metacontrol:
    class: regraft.adaptation_manager.planners.metacontrol.metacontroller:Metacontroller
    parameters: {{skills: carrier.skills, first_rest: 1.0, longest_rest: 2.0}}
  bt_executor: {{class: 'regraft.services.bt_executor.executor:Executor'}}
modes: system_modes.yaml
"""
STACK = f"""\
system: tests
clock: real
imports: [{PARTS}]
topics: {{adaptations: regraft/AdaptationReport, architecture: regraft/Architecture}}
robots:
  north: carrier
  south: carrier
components:
  adaptation_manager: {{class: 'regraft.adaptation_manager.manager:AdaptationManager'}}
"""


def write(folder: Path, skills: str = SKILLS, stack: str = STACK) -> Path:
    """Write the stack, the robot, and what is generated from its skills; return the stack's path."""
    robot = folder / "carrier"
    robot.mkdir()
    (robot / "carrier.xml").write_text("<mujoco/>")
    (robot / "robot.yaml").write_text(CARRIER)
    (robot / "carrier.skills").write_text(SKILLS)
    write_files(generated(read_skills(robot / "carrier.skills")), robot)
    (robot / "carrier.skills").write_text(skills)
    file = folder / "stack.yaml"
    file.write_text(stack)
    return file
