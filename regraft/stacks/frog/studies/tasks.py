"""Evaluation A of ReBeT: a requirement decides on the task (E. G. Alberts et al., ACSOS 2024, section IV-A).

FROG explores a room under MinBatterySystem: below 90 % it goes charging, then continues. The original had no battery
and one run; here each room has its own.
"""

from __future__ import annotations

from pathlib import Path

from regraft.evaluation.study import Configuration, Study
from regraft.stacks.frog.studies.exploring_measures import COLUMNS
from regraft.stacks.frog.studies.tasks_report import report

ADDITIONS = {
    "components": {
        "gateway": {"parameters": {"port": 0}},
        "explorer": {"parameters": {"strategy": "furthest"}},  # as the original's
        "rows": {
            "class": "regraft.stacks.frog.studies.exploring_recorder:ExploringRecorder",
            "parameters": {"file": "$RUN/rows.csv"},
        },
    },
    # Lasts for a frontier or two, as the original's limit.
    "robot": {"components": {"battery": {"parameters": {"capacity": 900.0}}}},
}
STUDY = Study(
    "frog-tasks",
    "Does a requirement in the tree keep FROG's battery full?",
    Path(__file__).parents[1] / "explore.yaml",
    {"corrected": (Configuration("exploring", "frontier by frontier, charging below 90 %"),)},
    report,
    ADDITIONS,
    seconds=400.0,
    runs=10,
    measures={"corrected": COLUMNS},
)
