"""The system whose components fail."""

from __future__ import annotations

from pathlib import Path

STACK = """\
system: tests
clock: simulated
speed: max
imports: [tests.faults.parts]
topics:
  position: {type: faults/Sample}
  commands: {type: faults/Sample, writers: many}
  decided: {type: faults/Sample}
  adaptations: {type: regraft/AdaptationReport}
  architecture: {type: regraft/Architecture}
components:
  world: {class: 'tests.faults.parts:World'}
  driver: {class: 'tests.faults.parts:Driver'}
  spare: {class: 'tests.faults.parts:Driver', state: inactive}
  decider: {class: 'tests.faults.parts:Decider'}
  summary: {class: 'tests.faults.parts:Summary'}
  adaptation_manager:
    class: regraft.adaptation_manager.manager:AdaptationManager
    parameters: {journal: $RUN/journal.sqlite}
"""
UNDER_THE_REAL_CLOCK = STACK.replace("clock: simulated\nspeed: max\n", "clock: real\n").replace(
    "  world: {class: 'tests.faults.parts:World'}\n", "  world: {class: 'tests.faults.parts:Beacon'}\n"
)


def write(folder: Path, text: str = STACK, faults: str = "") -> Path:
    """Return a stack file with a schedule."""
    file = folder / "stack.yaml"
    file.write_text(text + (f"faults:\n{faults}" if faults else ""))
    return file
