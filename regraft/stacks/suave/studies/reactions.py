"""Reaction times in SUAVE's mission by its own definition, to be compared with what was published (SEAMS 2023).

``published`` has the schedule of the published runs: thruster 1 fails at 35 s, the visibility begins with its highest,
and there is no battery. ``drawn`` draws each run's schedule from the seed, as SUAVE's runner does (suave_runner.py):
where in its period the visibility begins, and when thrusters 1 and 3 fail, from 0 to 200 s. It has the battery.
"""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any, Final

from regraft.evaluation.study import Configuration, Study
from regraft.stacks.suave.studies.measures import MEASURES
from regraft.stacks.suave.studies.reactions_report import report

PERIOD: Final = 80.0
"""s: of the visibility."""
LATEST_FAILURE: Final = 200.0
"""s: 100 s, with up to 100 s more or less."""
NO_BATTERY: Final = 1e9

ADDITIONS: Final = {
    "components": {
        "mission_metrics": {
            "class": "regraft.stacks.suave.studies.metrics:MissionMetrics",
            "parameters": {"file": "$RUN/rows.csv"},
        }
    }
}


def published(seed: int) -> dict[str, Any]:
    """Return the schedule of the published runs; all seeds have one."""
    return {"components": {"battery_monitor": {"parameters": {"discharge_time": NO_BATTERY}}}}


def drawn(seed: int) -> dict[str, Any]:
    """Return a schedule drawn from a seed.

    >>> drawn(1) == drawn(1), drawn(1) == drawn(2)
    (True, False)
    """
    dice = random.Random(seed)
    shift = round(dice.uniform(0.0, PERIOD), 3)
    failures = sorted((round(dice.uniform(0.0, LATEST_FAILURE), 3), thruster) for thruster in (1, 3))
    return {
        "components": {
            "water_visibility_observer_node": {"parameters": {"water_visibility_sec_shift": shift}},
            "thruster_monitor": {
                "parameters": {"thruster_events": [{"thruster": thruster, "at": at} for at, thruster in failures]}
            },
        }
    }


STUDY = Study(
    "suave-reactions",
    "How soon does the metacontroller answer SUAVE's disturbances?",
    Path(__file__).parents[1] / "stack.yaml",
    {
        "corrected": (
            Configuration("published", "the schedule of the published runs", published),
            Configuration("drawn", "a schedule drawn from the seed, with a battery", drawn),
        )
    },
    report,
    ADDITIONS,
    seconds=300.0,
    runs=10,
    measures={"corrected": MEASURES},
)
