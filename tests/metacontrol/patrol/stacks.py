"""The stack of the patrol, under either clock, with what is generated from ``navigation.skills``."""

from __future__ import annotations

from pathlib import Path

from regraft.adaptation_manager.planners.metacontrol.skills.generators.writing import generated, write_files
from regraft.adaptation_manager.planners.metacontrol.skills.reading import LIBRARY, read_skills

PARTS = "tests.metacontrol.patrol.parts"
STACK = f"""\
system: tests
clock: simulated
speed: max
seed: 1
imports: [{PARTS}]
topics:
  light: {{type: regraft/LightLevel}}
  diagnostics: {{type: regraft/Diagnostic, writers: many}}
  adaptations: {{type: regraft/AdaptationReport}}
  architecture: {{type: regraft/Architecture}}
components:
  world: {{class: '{PARTS}:World'}}
  workshop: {{class: '{PARTS}:Workshop'}}
  amcl: {{class: '{PARTS}:Localizer', state: inactive}}
  bt_navigator: {{class: '{PARTS}:Navigator', state: inactive}}
  controller_server: {{class: '{PARTS}:Controller', state: inactive, parameters: {{FollowPath.max_vel_x: 0.2}}}}
  pointcloud_to_laser: {{class: '{PARTS}:Beacon', state: inactive}}
  laser_resender: {{class: '{PARTS}:Beacon', state: inactive}}
  camera: {{class: '{PARTS}:Beacon', state: inactive}}
  battery: {{class: '{PARTS}:Beacon', state: inactive}}
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
  adaptation_manager:
    class: regraft.adaptation_manager.manager:AdaptationManager
    parameters: {{journal: $RUN/journal.sqlite}}
    restart: {{limit: 100, window: 1, backoff: 0.01}}
modes: system_modes.yaml
"""
PATROL = ("amcl", "bt_navigator", "controller_server", "pointcloud_to_laser", "laser_resender", "camera", "battery")
REALIZATIONS = ("normal", "performance", "slow", "energy_saving", "degraded", "degraded_energy_save")


def write(folder: Path, *, simulated: bool = True, more: str = "") -> Path:
    """Return the stack file, in a folder with what is generated; ``more`` are further components."""
    write_files(generated(read_skills(LIBRARY / "navigation.skills")), folder)
    text = STACK.replace("modes: system", f"{more}modes: system")
    if not simulated:
        text = text.replace("clock: simulated\nspeed: max\n", "clock: real\n")
        text = text.replace(f"  world: {{class: '{PARTS}:World'}}\n", "")
    file = folder / "stack.yaml"
    file.write_text(text)
    return file
