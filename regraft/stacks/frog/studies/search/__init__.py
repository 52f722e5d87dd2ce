"""FROG's search in many rooms: it maps an unknown one, charging when it has to, then visits things and finds one."""

from __future__ import annotations

from pathlib import Path

from regraft.evaluation.study import Configuration, Study
from regraft.stacks.frog.studies.search.measures import MEASURES
from regraft.stacks.frog.studies.search.report import report

ADDITIONS = {
    "components": {
        "camera": {"parameters": {"renderer": "ray"}},  # equal pictures on every machine
        "gateway": {"parameters": {"port": 0}},
        "rows": {
            "class": "regraft.stacks.frog.studies.search.recorder:SearchRecorder",
            "parameters": {"file": "$RUN/rows.csv"},
        },
    },
}
STUDY = Study(
    "frog-search",
    "Is an unknown room mapped, and the hydrant found?",
    Path(__file__).parents[2] / "search.yaml",
    {"corrected": (Configuration("search", "explores, charges below 90 %, visits, and looks for the hydrant"),)},
    report,
    ADDITIONS,
    seconds=900.0,
    runs=20,
    measures={"corrected": MEASURES},
)
