"""FROG's search is recorded to its verdict, and judged by its promises."""

from __future__ import annotations

from pathlib import Path

from regraft import Component, service
from regraft.bus_schema.messages.mission import MissionState, MissionStatus
from regraft.evaluation.finding import find_study
from regraft.evaluation.judgement import Judgement, JudgementRequest
from regraft.evaluation.rows import Rows, read_rows
from regraft.evaluation.study import Results, RunRecord, Timing
from regraft.stacks.frog.studies.search.measures import MEASURES
from regraft.stacks.frog.studies.search.recorder import VERDICT, SearchRecorder
from regraft.stacks.frog.studies.search.report import are_kept, report
from regraft.testing import Rig


class Judging(Component):
    """Gives a verdict."""

    @service("judgement")
    def judgement(self, request: JudgementRequest) -> Judgement:
        """Return one with a map of 0.95 and a target missed by 0.05 m."""
        return Judgement(self.kit.now(), "succeeded", 4.0, 0, 30.0, {"hydrant": 3.0}, occupied_iou=0.95)


def recorded(file: Path, ended: float | None) -> Rows:
    """Return the rows of ten seconds in which the mission ends at ``ended``."""
    with Rig() as rig:
        rig.add(Judging, "judge")
        rig.add(SearchRecorder, "rows", {"file": str(file), "judged_from": 2.0, "judged_by": 8.0})
        for second in range(1, 11):
            over = ended is not None and second >= ended
            state = MissionState.SUCCEEDED if over else MissionState.RUNNING
            rig.publish("mission", MissionStatus(float(second), state, "Search", 1))
            rig.advance(1.0)
    return read_rows(file)


def test_the_row_with_the_verdict_is_the_last(tmp_path: Path) -> None:
    rows = recorded(tmp_path / "rows.csv", ended=4.0)
    assert rows.are_over
    assert rows.text("over") == ["0"] * (len(rows) - 1) + ["1"]
    assert 6.0 <= rows.number("time")[-1] <= 8.0
    assert rows.text("occupied_iou")[:-1] == [""] * (len(rows) - 1)
    assert MEASURES["occupied_iou"](rows) == 0.95
    assert (MEASURES["succeeded"](rows), MEASURES["visited"](rows)) == (1.0, 1.0)


def test_a_mission_that_does_not_end_is_judged_all_the_same(tmp_path: Path) -> None:
    rows = recorded(tmp_path / "rows.csv", ended=None)
    assert rows.are_over
    assert 8.0 <= rows.number("time")[-1] <= 9.0
    assert MEASURES["succeeded"](rows) == 0.0


def run(seed: int, **judged: object) -> RunRecord:
    """Return a run that keeps all promises but for what is ``judged`` otherwise."""
    good: dict[str, object] = {
        **dict.fromkeys(VERDICT, 0.0),
        "visited": 4, "pose_error": 0.02, "occupied_iou": 0.95, "free_iou": 0.99, "target_error": 0.05,
        "charges_exploring": 2, "lowest_charge": 0.6,
    }  # fmt: skip
    cells = {name: str(value) for name, value in {"mission": "succeeded", **good, **judged, "over": 1}.items()}
    (configuration,) = find_study("frog-search").configurations["corrected"]
    rows = Rows({name: [cell] for name, cell in cells.items()})
    return RunRecord(configuration, seed, seed, 900.0, rows, (), {}, Timing(1.0, 60.0))


def test_promises_hold_when_nine_of_ten_rooms_keep_them() -> None:
    runs = [run(seed) for seed in range(9)]
    assert are_kept([*runs, run(9, pose_error=0.2)], 0)
    assert not are_kept([*runs, run(9, lowest_charge=0.0)], 0)
    assert not are_kept([run(9, missed=1), *runs[:8]], 1)


def test_the_report_has_a_row_for_every_room_and_a_line_for_every_promise() -> None:
    text = report(Results("corrected", [run(1), run(2, target_error="")], planned=2)).markdown
    assert "| 1 | 0 | 0.950 | 0.990 |" in text
    assert "hydrant located within 0.3 m: 1 of 2 (BROKEN, needs 2)" in text
