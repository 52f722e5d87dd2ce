"""A study that takes a second or two a run."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from regraft.evaluation.reports.sections import arms_of, head, measures_table
from regraft.evaluation.rows import Rows
from regraft.evaluation.study import Configuration, Report, Results, Study


def stride(seed: int, by: float = 1.0) -> dict[str, Any]:
    """Return what has the counter go so fast."""
    return {"components": {"counter": {"parameters": {"stride": by}}}}


def broken(seed: int) -> dict[str, Any]:
    """Return what makes the stack of every even seed impossible."""
    return {"components": {"counter": {"parameters": {"stride": 1.0 if seed % 2 else "sideways"}}}}


def reached(rows: Rows) -> float:
    """Return the last number."""
    return rows.number("number")[-1]


def report(results: Results) -> Report:
    """Return the numbers reached."""
    arms = arms_of(results)
    text = head("Counting", results) + "\n" + measures_table(arms, {"reached": reached})
    return Report(text, {"note.txt": b"a file beside it\n"})


def crashing(seed: int) -> dict[str, Any]:
    """Return what ends the world's process in the middle of a run."""
    return {"components": {"counter": {"parameters": {"ends_at": 20}, "restart": {"limit": 0}}}}


def disturbed(seed: int) -> dict[str, Any]:
    """Return what ends a listener by a schedule."""
    listener = {"class": "tests.evaluation.tiny_parts:Listener"}
    return {"components": {"listener": listener}, "faults": [{"at": 1, "component": "listener", "kind": "kill"}]}


def painting(seed: int, renderer: str) -> dict[str, Any]:
    """Return what has pictures drawn."""
    painter = {"class": "tests.evaluation.tiny_parts:Painter", "parameters": {"renderer": renderer}}
    return {"components": {"painter": painter}}


ADDITIONS = {
    "components": {
        "rows": {"class": "tests.evaluation.tiny_parts:CountRecorder", "parameters": {"file": "$RUN/rows.csv"}}
    }
}
STUDY = Study(
    "tiny",
    "does counting pay?",
    Path(__file__).with_name("tiny.yaml"),
    {
        "plain": (
            Configuration("slow", "one at a time", partial(stride, by=1.0)),
            Configuration("fast", "two at a time", partial(stride, by=2.0)),
        ),
        "disturbed": (Configuration("killed", "has a listener that a schedule ends", disturbed),),
        "seeing": (
            Configuration("camera", "drives by pictures", partial(painting, renderer="ray")),
            Configuration("lidar", "drives without"),
            Configuration("stereo", "drives by more pictures", partial(painting, renderer="ray")),
            Configuration("other", "drives by other pictures", partial(painting, renderer="egl")),
        ),
        "deadly": (Configuration("crashing", "ends its own process", crashing),),
        "hard": (Configuration("breaking", "cannot be run with even seeds", broken),),
    },
    report,
    ADDITIONS,
    seconds=4.0,
    runs=2,
    measures={"plain": {"reached": reached}, "hard": {"reached": reached}},
)
CONSTANT_CHANGED = replace(
    STUDY,
    configurations={
        "plain": (STUDY.configurations["plain"][0], Configuration("fast", "faster by now", partial(stride, by=2.5)))
    },
)
"""The study with a constant of one arm changed."""
DEFINITION_CHANGED = replace(STUDY, measures={"plain": {"reached": lambda rows: reached(rows) / 2.0}})
"""The study with another definition of its measure."""
ENDING = replace(
    STUDY,
    additions={
        "components": {
            "rows": {**ADDITIONS["components"]["rows"], "class": "tests.evaluation.tiny_parts:EndingRecorder"}
        }
    },
    seconds=4000.0,
)
"""The study with a recorder that ends long before its runs would."""
CONFIRMING = replace(
    ENDING,
    additions={
        "topics": {
            "adaptations": {"type": "regraft/AdaptationReport"},
            "architecture": {"type": "regraft/Architecture"},
        },
        "components": {
            **ENDING.additions["components"],
            "adapter": {"class": "tests.evaluation.tiny_parts:Adapter"},
            "adaptation_manager": {
                "class": "regraft.adaptation_manager.manager:AdaptationManager",
                "parameters": {"journal": "$RUN/journal.sqlite"},
            },
        },
    },
)
"""That study with an adaptation that is still to be confirmed when the last row is written."""
