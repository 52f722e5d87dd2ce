"""How well different managers keep a patrol going, compared as SUAVE compares them (SEAMS 2023)."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Final

from regraft.evaluation.study import Changes, Configuration, Study, joined, variant
from regraft.stacks.patrol.studies.contingencies import SECONDS, contingencies
from regraft.stacks.patrol.studies.managers_report import report
from regraft.stacks.patrol.studies.patrol_measures import CAMERA, COLUMNS, CROWD, LASER

FOLDER: Final = Path(__file__).parents[1]
RECORDED: Final = FOLDER / "recorded.yaml"
"""The stack that studies run."""


def with_contingencies(differences: Changes) -> Callable[[int], Changes]:
    """Return what is different for a seed: the manager, and what goes wrong in that run."""

    def changes(seed: int) -> Changes:
        drawn = contingencies(seed)
        spells = ((LASER, drawn.laser), (CAMERA, drawn.camera), (CROWD, drawn.crowd))
        recorded = [{"name": name, "begin": spell.begin, "end": spell.end} for name, spell in spells]
        record: Changes = {"components": {"rows": {"parameters": {"spells": recorded}}}}
        return joined(differences, drawn.changes(), record)

    return changes


def _arm(name: str, text: str, file: str = "") -> Configuration:
    return Configuration(name, text, with_contingencies(variant(FOLDER / file) if file else {}))


STUDY = Study(
    "patrol-managers",
    "Which manager keeps a patrol going when things go wrong?",
    RECORDED,
    {
        "measured": (
            _arm("metacontrol", "the metacontroller, by the skills with their measured qualities"),
            _arm("rules", "rules that enter modes, as in ROS 2's system_modes", "rules.yaml"),
            _arm("tree", "rules in the mission's behaviour tree", "tree.yaml"),
            _arm("random", "another realization at random every 20 s", "random.yaml"),
            _arm("none", "nothing: sensors and tree of normal at up to 0.5 m/s, all the time", "none.yaml"),
        )
    },
    report,
    seconds=SECONDS,
    runs=20,
    measures={"measured": COLUMNS},
    claims={"measured": FOLDER / "studies" / "claims.yaml"},
)
