"""Test equipment: a robot with the published realizations of a patrol, in this process, in step."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from regraft.adaptation_manager.planners.metacontrol.reasoning.analysis import Analyser, Analysis
from regraft.adaptation_manager.planners.metacontrol.reasoning.situation import Situation
from regraft.adaptation_manager.planners.metacontrol.skills.generators.system_modes import system_modes
from regraft.adaptation_manager.planners.metacontrol.skills.reading import read_skills
from regraft.bus.memory_bus import MemoryHub
from regraft.bus_schema.messages.management.objectives import Objective
from regraft.stack import load
from tests.adaptation.host_stub import HostStub
from tests.adaptation.system import System
from tests.metacontrol.control.parts import PLANNER, Director, Part
from tests.support.waiting import wait_until

SKILLS = """\
import "navigation_definitions.skills"

Component controller {
  Configuration active.DEFAULT { speed: 0.4 },
  Configuration active.FAST { speed: 0.5 },
  Configuration active.SLOW { speed: 0.1 }
}
Component navigator {
  Configuration active.DEFAULT { careful: true },
  Configuration active.SIMPLE { careful: false }
}
Component laser observable { Configuration active }
Component camera observable { Configuration active }
Component battery observable { Configuration active }

Realization normal of to_navigate {
  Component navigator active, Component controller active, Component laser active, Component battery active
  Quality [safety: 0.8, performance: 0.7, energy: 0.5]; context: Default
};
Realization performance of to_navigate {
  Component navigator active.SIMPLE, Component controller active.FAST, Component laser active, Component battery active
  Quality [safety: 0.55, performance: 0.9, energy: 0.7]; context: Default
};
Realization slow of to_navigate {
  Component navigator active, Component controller active.SLOW, Component laser active, Component battery active
  Quality [safety: 0.7, performance: 0.4, energy: 0.3]; context: Default
};
Realization energy_saving of to_navigate {
  Component navigator active.SIMPLE, Component controller active.SLOW, Component laser active
  Quality [safety: 0.6, performance: 0.3, energy: 0.34]; context: Default
};
Realization degraded of to_navigate {
  Component navigator active, Component controller active.SLOW, Component camera active, Component battery active
  Quality [safety: 0.55, performance: 0.2, energy: 0.45]; context: Default
};
Realization degraded_energy_save of to_navigate {
  Component navigator active.SIMPLE, Component controller active.SLOW, Component camera active
  Quality [safety: 0.6, performance: 0.1, energy: 0.34]; context: Default
};
Realization docking of to_recharge {
  Component dock { Configuration active { speed: 0.05 } }
  Quality [safety: 0.8, energy: 0.1];
  requires to_navigate [safety >= 0.5];
  context: Default
};
"""
STACK = """\
system: t
clock: simulated
imports: [tests.metacontrol.control.parts, tests.modes.parts]
topics:
  ticks: {{type: modes/Sample}}
  diagnostics: {{type: regraft/Diagnostic}}
  adaptations: {{type: regraft/AdaptationReport}}
  architecture: {{type: regraft/Architecture}}
components:
  world: {{class: 'tests.modes.parts:World', parameters: {{speed: max}}}}
{parts}
  director: {{class: 'tests.metacontrol.control.parts:Director'}}
  metacontrol:
    class: 'regraft.adaptation_manager.planners.metacontrol.metacontroller:Metacontroller'
    parameters: {{{parameters}}}
  adaptation_manager:
    class: regraft.adaptation_manager.manager:AdaptationManager
    parameters: {{journal: journal.sqlite}}
modes: modes.yaml
{more}"""
PARTS = ("laser", "camera", "battery", "controller", "navigator", "dock")
PATROL = Objective("to_navigate", "patrol", {"safety": 0.5, "energy": 0.5})


DEFAULTS: dict[str, Any] = {"skills": "patrol.skills", "period": 0.5, "settle": 0.2, "hold": 0.3, "saved_in": "."}


def write(
    folder: Path,
    skills: str = SKILLS,
    parameters: dict[str, Any] | None = None,
    parts: dict[str, str] | None = None,
    active: tuple[str, ...] = (),
    more: str = "",
    modes: str = "",
) -> Path:
    """Write a stack with its skills; ``parameters`` are the metacontroller's, ``parts`` has those of parts.

    Parts are inactive at the start, but for those in ``active``. ``more`` is what else the stack file has. ``modes``
    are its own, in place of those that the skills give.
    """
    given = ", ".join(f"{name}: {value}" for name, value in (DEFAULTS | (parameters or {})).items())
    (folder / "patrol.skills").write_text(skills)
    (folder / "modes.yaml").write_text(system_modes(read_skills(folder / "patrol.skills")))
    states = {name: "active" if name in active else "inactive" for name in PARTS}
    lines = [
        f"  {name}: {{class: 'tests.metacontrol.control.parts:Part', state: {states[name]}"
        f"{', parameters: {' + (parts or {})[name] + '}' if name in (parts or {}) else ''}}}"
        for name in PARTS
    ]
    file = folder / "stack.yaml"
    stack = STACK.format(parts="\n".join(lines), parameters=given, more=more)
    file.write_text(stack.replace("modes: modes.yaml\n", modes or "modes: modes.yaml\n"))
    return file


@contextmanager
def running(folder: Path, script: Callable[[Director], Awaitable[None]], **more: Any) -> Iterator[System]:
    """Run the robot, whose director acts by a script."""
    Director.script = staticmethod(script)
    Part.well.clear()
    architecture = load(write(folder, **more)).architecture
    hub = MemoryHub()
    system = Director.system = System(hub, architecture, HostStub(hub, architecture), folder / "journal.sqlite")
    try:
        for name in ("adaptation_manager", *PARTS, PLANNER, "director", "world"):
            system.start(name)
        yield system
    finally:
        system.end()


def perform(folder: Path, script: Callable[[Director], Awaitable[None]], **more: Any) -> None:
    """Run the robot until its director has acted; raises what went wrong."""
    with running(folder, script, **more) as system:
        director = system.running["director"].component
        wait_until(lambda: getattr(director, "done", False), "the end of the script")
        if director.failure is not None:
            raise director.failure


class BreakableReasoner:
    """The analyse step of all metacontrollers here; while it has an ``error``, it raises that."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, error: Exception | None = None) -> None:
        self.error = error
        whole = Analyser.analyse

        def analyse(analyser: Analyser, situation: Situation) -> Analysis:
            if self.error is not None:
                raise self.error
            return whole(analyser, situation)

        monkeypatch.setattr(Analyser, "analyse", analyse)
