"""What is said of a run's requirements: how long each was satisfied, as a table and as a picture."""

from __future__ import annotations

import importlib.util
import json
from dataclasses import replace
from pathlib import Path

import pytest

from regraft.bus_schema.messages.quality import Quality
from regraft.bus_schema.model.adaptation import AdaptationReport, AdaptationRequest, Outcome, SetParameters
from regraft.evaluation.quality_over_time import Spell, Standing, main, report, satisfied_share, spells, write_report
from regraft.evaluation.runs.quality_run import QualityRun

GOOD = Quality(1.0, "MoveSafely", "Safety", node="A/MoveSafely::7", metric=0.5, satisfied=True)
TOLD = (
    GOOD,
    replace(GOOD, stamp=2.0, metric=0.4),
    replace(GOOD, stamp=4.0, satisfied=False),
    replace(GOOD, stamp=5.0, satisfied=None, metric=None),
    replace(GOOD, stamp=7.0, satisfied=False, active=False),
    replace(GOOD, stamp=9.0),
)


def run(**counts: dict[str, int]) -> QualityRun:
    """Return a run of ten seconds with an adaptation in it."""
    request = AdaptationRequest((SetParameters("navigator", {"max_velocity": 0.1}),))
    closing = {"contacts": 0, "distance": 1.25, **counts}
    applied = AdaptationReport("2", Outcome.APPLIED, request, 1, 2, 3.0)
    return QualityRun(
        "rounds",
        10.0,
        list(TOLD),
        [applied],
        [],
        [(0.5, 0.9)],
        [(0.0, 0.26), (3.0, 0.1)],
        [(0.0, "camera/image")],
        closing,
    )


def test_what_is_told_holds_until_the_next_and_not_while_the_task_rests() -> None:
    assert spells(TOLD, 10.0) == {
        "MoveSafely": [
            Spell(1.0, 4.0, Standing.SATISFIED),
            Spell(4.0, 5.0, Standing.VIOLATED),
            Spell(5.0, 7.0, Standing.UNKNOWN),
            Spell(9.0, 10.0, Standing.SATISFIED),
        ]
    }


def test_the_share_is_that_of_the_time_for_which_it_is_known() -> None:
    assert satisfied_share(spells(TOLD, 10.0)["MoveSafely"]) == pytest.approx(4.0 / 5.0)
    assert satisfied_share([Spell(0.0, 1.0, Standing.UNKNOWN)]) is None


def test_requirements_are_in_the_tree_s_order() -> None:
    first = replace(GOOD, stamp=2.0, requirement="First", node="A/First::3")
    assert list(spells([*TOLD, first], 10.0)) == ["First", "MoveSafely"]


def test_the_table_has_a_column_for_every_run() -> None:
    said = report([run(visits={"a": 1, "b": 2}), run()])
    assert "| MoveSafely satisfied | 80% of 5 s | 80% of 5 s |" in said
    assert "| visits | 3 (a 1, b 2) | 0 |" in said
    assert "| adaptations | 1 applied | 1 applied |" in said


def test_records_and_pictures_are_written(tmp_path: Path) -> None:
    write_report([run()], tmp_path)
    lines = [json.loads(line) for line in (tmp_path / "rounds.jsonl").read_text().splitlines()]
    kinds = [line["kind"] for line in lines]
    assert kinds == ["quality"] * 6 + ["adaptation", "darkness", "max_velocity", "max_velocity", "camera", "closing"]
    assert (tmp_path / "rounds.png").exists() == (importlib.util.find_spec("matplotlib") is not None)


def test_missions_of_one_name_are_refused_before_any_is_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    missions = [word for name in ("a/main.xml", "b/main.xml") for word in ("--mission", name)]
    with pytest.raises(SystemExit) as ended:
        main(["--stack", "frog", *missions, "--out", str(tmp_path / "out")])
    assert ended.value.code == 2
    assert "two missions are named 'main'" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
