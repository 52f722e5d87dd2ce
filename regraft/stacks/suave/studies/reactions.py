"""SUAVE's mission under its managers (SEAMS 2023): how soon they react by its definition, and what is inspected.

The managers are the metacontroller, one that chooses at random, and none. There are two scenarios. ``published`` has
the schedule of the published runs: thruster 1 fails at 35 s, the visibility begins with its highest, and there is no
battery. ``drawn`` draws each run's schedule from the seed, as SUAVE's runner does (suave_runner.py): where in its
period the visibility begins, and when thrusters 1 and 3 fail, from 0 to 200 s. It has the battery.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final

from regraft.evaluation.study import Changes, Configuration, Study, joined, variant
from regraft.stacks.suave.studies.measures import MEASURES
from regraft.stacks.suave.studies.reactions_report import report

FOLDER: Final = Path(__file__).parents[1]
STACK: Final = "stack.yaml"
PERIOD: Final = 80.0
"""s: of the visibility."""
LATEST_FAILURE: Final = 200.0
"""s: 100 s, with up to 100 s more or less."""
NO_BATTERY: Final = 1e9


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


SCENARIOS: Final = {
    "published": (published, "the schedule of the published runs"),
    "drawn": (drawn, "a schedule drawn from the seed, with a battery"),
}
MANAGERS: Final = {
    "metacontrol": (STACK, "the metacontroller"),
    "random": ("random.yaml", "another mode at random every 30 s"),
    "none": ("none.yaml", "nothing: the search is at 1 m"),
}


def _configurations() -> Iterator[Configuration]:
    for scenario, (schedule, circumstances) in SCENARIOS.items():
        for manager, (file, text) in MANAGERS.items():
            differences = variant(FOLDER / file) if file != STACK else {}
            yield Configuration(manager, f"{text}; {circumstances}", _both(differences, schedule), scenario)


def _both(differences: Changes, schedule: Callable[[int], Changes]) -> Callable[[int], Changes]:
    return lambda seed: joined(differences, schedule(seed))


STUDY = Study(
    "suave-reactions",
    "Which manager answers SUAVE's disturbances, and how soon?",
    FOLDER / "recorded.yaml",
    {"corrected": tuple(_configurations())},
    report,
    seconds=300.0,
    runs=10,
    measures={"corrected": MEASURES},
)
