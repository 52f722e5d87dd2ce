"""The stack of the patrol, under either clock, with what is generated from ``navigation.skills``."""

from __future__ import annotations

from pathlib import Path

from regraft.adaptation_manager.planners.metacontrol.skills.generators.writing import generated, write_files
from regraft.adaptation_manager.planners.metacontrol.skills.reading import read_skills

PARTS = "tests.metacontrol.patrol.parts"
STACK = f"""\
system: tests
clock: simulated
speed: max
seed: 1
imports: [{PARTS}, tests.modes.parts]
topics:
  ticks: {{type: modes/Sample}}
  diagnostics: {{type: regraft/Diagnostic, writers: many}}
  adaptations: {{type: regraft/AdaptationReport}}
  architecture: {{type: regraft/Architecture}}
components:
  world: {{class: 'tests.modes.parts:World'}}
  workshop: {{class: '{PARTS}:Workshop'}}
  amcl: {{class: '{PARTS}:Localizer', state: inactive, parameters: {{kills: $RUN/kills}}}}
  bt_navigator: {{class: '{PARTS}:Navigator', state: inactive, parameters: {{kills: $RUN/kills}}}}
  controller_server:
    class: '{PARTS}:Controller'
    state: inactive
    parameters: {{kills: $RUN/kills, FollowPath.max_vel_x: 0.2}}
  pointcloud_to_laser: {{class: '{PARTS}:Beacon', state: inactive, parameters: {{kills: $RUN/kills}}}}
  laser_resender: {{class: '{PARTS}:Beacon', state: inactive, parameters: {{kills: $RUN/kills}}}}
  camera: {{class: '{PARTS}:Beacon', state: inactive, parameters: {{kills: $RUN/kills}}}}
  battery: {{class: '{PARTS}:Beacon', state: inactive, parameters: {{kills: $RUN/kills}}}}
  component_observer:
    class: regraft.services.observers.component_observer:ComponentObserver
    parameters: {{observed: observed_components.yaml}}
    restart: {{limit: 100, window: 1, backoff: 0.01}}
  quality_observer:
    class: regraft.services.observers.quality_observer:QualityObserver
    parameters:
      qualities:
        - {{quality: safety, measured: workshop.safety}}
        - {{quality: energy, measured: workshop.energy}}
    restart: {{limit: 100, window: 1, backoff: 0.01}}
  metacontrol:
    class: regraft.adaptation_manager.planners.metacontrol.metacontroller:Metacontroller
    parameters: {{skills: patrol.skills, first_rest: 1.0, longest_rest: 2.0}}
    restart: {{limit: 100, window: 1, backoff: 0.01}}
  adaptation_manager:
    class: regraft.adaptation_manager.manager:AdaptationManager
    parameters: {{journal: $RUN/journal.sqlite}}
    restart: {{limit: 100, window: 1, backoff: 0.01}}
modes: system_modes.yaml
"""
PATROL = ("amcl", "bt_navigator", "controller_server", "pointcloud_to_laser", "laser_resender", "camera", "battery")
REALIZATIONS = ("normal", "performance", "slow", "energy_saving", "degraded", "degraded_energy_save")


SCHEDULE = f"""\
  summary: {{class: 'tests.modes.parts:Summary'}}
  schedule:
    class: '{PARTS}:Schedule'
    parameters:
      happenings:
        - {{at: 3.0, component: laser_resender}}
        - {{at: 6.0, component: battery}}
        - {{at: 9.0, component: laser_resender, well: true}}
        - {{at: 12.0, component: battery, well: true}}
"""


def write(folder: Path, *, simulated: bool = True, for_good: str = "") -> Path:
    """Return the stack file, in a folder with what is generated.

    Simulated time has a schedule of failures. The component ``for_good`` is not restarted when it ends.
    """
    skills = folder / "patrol.skills"
    skills.write_text('import "navigation.skills"\n')
    write_files(generated(read_skills(skills)), folder)
    text = STACK.replace("modes: system", SCHEDULE + "modes: system") if simulated else STACK
    if not simulated:
        text = text.replace("clock: simulated\nspeed: max\n", "clock: real\n")
        text = text.replace("  world: {class: 'tests.modes.parts:World'}\n", "")
    if for_good:
        text = text.replace(f"  {for_good}: {{", f"  {for_good}: {{restart: never, ")
    file = folder / "stack.yaml"
    file.write_text(text)
    return file
