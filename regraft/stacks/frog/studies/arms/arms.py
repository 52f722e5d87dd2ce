"""The arms of evaluation B: ways to decide, each with all that any other may use, or a control of it.

All that adapt may choose among 0.10, 0.17 and 0.26 m/s every 250 ms. In that time a bandit's choice takes effect,
within 0.1 s at 2.5 m/s², and its speed is measured. They may choose either camera, 1 or 3 pictures, and 1.0 or 3.0 s
before each. Their information differs, as their kinds do. Bandits learn from rewards alone; plans and rules read what
they name. The forecast reads whether the hydrant stands ahead, and the contextual bandits learn on it.

None knows whether the corner camera sees the hydrant: in the scenario ``rooms`` nobody could. The forecast begins with
one half and learns from pictures, as the bandits do from rewards. The arms named ``published`` have the options of the
publication.

The room of the publication, in which the corner camera always sees the hydrant, is that of the published definitions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

from regraft.evaluation.study import Changes, Configuration, joined
from regraft.stacks.frog.studies.arms.scenarios import ALL, BLOCKED, ROOMS, SCENARIOS

IN_ROOMS: Final = (ROOMS,)
"""The scenario of most arms: nothing in it is the same in all runs."""


@dataclass(frozen=True, slots=True)
class Arm:
    """A way to decide: its mission, what else is different in the stack, and the scenarios that it is tried in."""

    name: str
    text: str
    mission: str
    velocity: float | None = None
    """m/s: the maximum to begin with, if not the greatest."""
    scenarios: tuple[str, ...] = IN_ROOMS

    def changes(self) -> Changes:
        """Return what is different in the stack file."""
        changes = mission(self.mission)
        return changes if self.velocity is None else joined(changes, driving(self.velocity))


def mission(name: str) -> Changes:
    """Return what has the robot run a mission."""
    return {"components": {"bt_executor": {"parameters": {"mission": f"missions/{name}.xml"}}}}


def driving(velocity: float) -> Changes:
    """Return what has the robot begin with a maximum velocity (m/s)."""
    return {"components": {"navigator": {"parameters": {"max_velocity": velocity}}}}


PLANNED: Final = "0.10, 0.17 or 0.26 m/s, and how to look"
ARMS: Final = (
    Arm("baseline", "no adaptation: 0.26 m/s, one picture of the own camera", "rounds_baseline"),
    Arm("internal", "internal plans for speed and pictures", "rounds_internal_common", scenarios=ALL),
    Arm("internal-published", "internal plans with the published options, every 3 s", "rounds_internal"),
    Arm("external", "bandits for speed and pictures", "rounds_external_common", scenarios=ALL),
    Arm("external-context", "contextual bandits, which learn on what the forecast reads", "rounds_external_context"),
    Arm(
        "external-published",
        "a bandit with the published speeds, every 3 s; the internal plan for pictures",
        "rounds_external",
    ),
    Arm("planned", f"the forecast chooses {PLANNED}", "rounds_planned", scenarios=ALL),
    Arm("planned-3s", "the forecast, with a decision on the speed every 3 s only", "rounds_planned_3s"),
    Arm("planned-018", "the forecast with the published speeds", "rounds_planned_018"),
    Arm("planned-no-lead", "the forecast by what is near now, not by what soon will be", "rounds_planned_no_lead"),
    Arm("planned-single", "the forecast; a look is one picture after 1 s", "rounds_planned_single"),
    Arm("planned-no-bearing", "the forecast, not knowing where the hydrant is", "rounds_planned_no_bearing"),
    Arm(
        "planned-no-rate",
        "the forecast, not learning whether the corner camera sees the hydrant",
        "rounds_planned_no_rate",
    ),
    Arm(
        "planned-unmonitored",
        "the forecast without the corner camera's monitor, which reports nothing elsewhere",
        "rounds_planned_unmonitored",
        scenarios=(BLOCKED,),
    ),
    Arm(
        "rules",
        "fixed rules: 0.17 m/s near things, the corner camera unless it is faulty",
        "rounds_rules",
        scenarios=ALL,
    ),
    Arm(
        "rules-learned",
        "the fixed rules; the own camera also where the corner camera hardly shows the hydrant",
        "rounds_rules_learned",
    ),
    Arm("always-0.26", "0.26 m/s, the fixed rule for pictures", "rounds_pictures"),
    Arm("always-0.17", "0.17 m/s, the fixed rule for pictures", "rounds_pictures", 0.17),
    Arm("always-external", "0.26 m/s, one picture of the corner camera", "rounds_corner", scenarios=ALL),
)


def configurations(additions: Changes) -> Iterator[Configuration]:
    """Yield each arm in each of its scenarios; ``additions`` are what all have."""
    for scenario, circumstances in SCENARIOS.items():
        for arm in ARMS:
            if scenario in arm.scenarios:
                yield Configuration(arm.name, arm.text, _changes(arm, circumstances, additions), scenario)


def _changes(arm: Arm, circumstances: Callable[[int], Changes], additions: Changes) -> Callable[[int], Changes]:
    def changes(seed: int) -> Changes:
        return joined(additions, arm.changes(), circumstances(seed))

    return changes
