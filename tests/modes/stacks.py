"""The stack of the acceptance example: three components with two modes, and rules between them."""

from __future__ import annotations

from pathlib import Path

MODES = """\
modes:
  normal:
    - {change: transition, component: laser, transition: activate}
    - {change: set_parameters, component: driver, parameters: {speed: 1.0}}
    - {change: transition, component: lamp, transition: deactivate}
  degraded:
    - {change: transition, component: laser, transition: deactivate}
    - {change: set_parameters, component: driver, parameters: {speed: 0.3}}
    - {change: transition, component: lamp, transition: activate}
"""
RULES = """\
rules:
  degrade:
    when: laser.failed or laser.state == 'gone'
    mode: degraded
    because: the laser is needed to drive fast
  recover:
    when: not laser.failed and laser.state != 'gone'
    from: degraded
    mode: normal
"""
STACK = """\
system: tests
clock: simulated
speed: max
imports: [tests.modes.parts]
topics:
  ticks: {type: modes/Sample}
  scans: {type: modes/Sample}
  adaptations: {type: regraft/AdaptationReport}
  architecture: {type: regraft/Architecture}
components:
  world: {class: 'tests.modes.parts:World'}
  laser: {class: 'tests.modes.parts:Laser', parameters: {kills: $RUN/kills}, restart: {limit: 100, window: 1}}
  driver: {class: 'tests.modes.parts:Driver', parameters: {kills: $RUN/kills}, restart: {limit: 100, window: 1}}
  lamp: {class: 'tests.modes.parts:Lamp', parameters: {kills: $RUN/kills}, state: inactive}
  summary: {class: 'tests.modes.parts:Summary'}
  adaptation_manager:
    class: regraft.adaptation_manager.manager:AdaptationManager
    parameters: {journal: $RUN/journal.sqlite}
    restart: {limit: 100, window: 1, backoff: 0.01}
  mode_planner:
    class: regraft.adaptation_manager.planners.modes.mode_planner:ModePlanner
    restart: {limit: 100, window: 1, backoff: 0.01}
"""
SIMULATED = STACK + MODES + RULES
REAL = (
    SIMULATED.replace("clock: simulated\nspeed: max\n", "clock: real\n")
    .replace(":World", ":Beacon")
    .replace("Laser', parameters: {", "Laser', parameters: {failures: 1000, ")
    .replace(":ModePlanner\n", ":ModePlanner\n    parameters: {circle_limit: 1000, dwell: 0.5}\n")
)


def write(folder: Path, text: str = SIMULATED) -> Path:
    """Return a stack file of the text."""
    file = folder / "stack.yaml"
    file.write_text(text)
    return file
