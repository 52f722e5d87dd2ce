"""Reactions are counted by SUAVE's definition: from the diagnostic to the change in effect."""

from __future__ import annotations

import math

from regraft.evaluation.rows import Rows
from regraft.evaluation.study import Configuration, Results, RunRecord, Timing
from regraft.stacks.suave.studies.events import BATTERY, THRUSTER, VISIBILITY, Reactions
from regraft.stacks.suave.studies.measures import MEASURES
from regraft.stacks.suave.studies.reactions import STUDY, drawn

MOTION, RECHARGE = "f_maintain_motion_node", "generate_recharge_path_node"


def seen(reactions: Reactions, kind: str) -> tuple[int, list[float]]:
    """Return the disturbances of a kind, and how long the answered ones took."""
    return reactions.tallies[kind].count, reactions.tallies[kind].answered


def test_thrusters_that_fail_before_the_answer_are_one_disturbance() -> None:
    reactions = Reactions()
    for time in (10.0, 11.0):
        reactions.see_thruster(time, failed=True)
    reactions.see_active(12.5, [MOTION])
    reactions.see_active(13.0, [MOTION])
    reactions.see_thruster(20.0, failed=False)
    reactions.see_active(21.0, [])
    reactions.see_active(22.0, [MOTION])
    assert seen(reactions, THRUSTER) == (1, [2.5])


def test_a_wrong_altitude_is_answered_by_that_of_the_latest_visibility() -> None:
    reactions = Reactions()
    reactions.see_altitude(0.0, 3.0)
    reactions.see_visibility(1.0, 3.25)
    reactions.see_visibility(2.0, 3.0)
    reactions.see_visibility(3.0, 1.3)
    reactions.see_altitude(3.5, 2.0)
    reactions.see_altitude(4.5, 1.0)
    assert seen(reactions, VISIBILITY) == (1, [2.5])


def test_nothing_is_expected_of_the_altitude_while_the_battery_is_low() -> None:
    reactions = Reactions()
    reactions.see_altitude(0.0, 3.0)
    reactions.see_visibility(1.0, 2.0)
    reactions.see_battery(2.0, 0.24)
    reactions.see_visibility(3.0, 2.0)
    reactions.see_altitude(4.0, 1.0)
    assert seen(reactions, VISIBILITY) == (1, [])
    reactions.see_battery(5.0, 1.0)
    reactions.see_visibility(6.0, 2.5)
    reactions.see_altitude(6.25, 2.0)
    assert seen(reactions, VISIBILITY) == (2, [0.25])


def test_a_battery_at_its_limit_is_not_low_and_one_below_is() -> None:
    reactions = Reactions()
    reactions.see_battery(1.0, 0.25)
    reactions.see_active(2.0, [RECHARGE])
    assert seen(reactions, BATTERY) == (0, [])
    reactions.see_active(3.0, [])
    reactions.see_battery(4.0, 0.2499)
    reactions.see_active(4.5, [RECHARGE])
    assert seen(reactions, BATTERY) == (1, [0.5])


def rows(thruster: tuple[int, float], visibility: tuple[int, float]) -> Rows:
    """Return a run of three seconds: reactions so far, and their seconds, of two kinds."""
    columns = {"time": ["1", "2", "3"], "found": ["0", "1", "1"], "distance": ["0", "0", "0.27"]}
    columns |= {"visibility": ["3.5"] * 3, "altitude": ["3", "3", "1"]}
    for kind, (count, seconds) in (("thruster", thruster), ("visibility", visibility), ("battery", (0, 0.0))):
        columns[f"{kind}_disturbances"] = ["0", "1", "2"]
        columns[f"{kind}_reactions"] = ["0", "0", str(count)]
        columns[f"{kind}_seconds"] = ["0", "0", str(seconds)]
    return Rows(columns)


def test_the_mean_is_over_all_kinds_and_unknown_without_a_reaction() -> None:
    run = rows((1, 1.0), (2, 5.0))
    assert MEASURES["mean reaction (s)"](run) == 2.0
    assert MEASURES["mean visibility reaction (s)"](run) == 2.5
    assert math.isnan(MEASURES["mean battery reaction (s)"](run))
    assert (MEASURES["searching (s)"](run), MEASURES["inspected (m)"](run)) == (2.0, 0.27)


def test_the_altitude_is_right_where_it_is_that_of_the_visibility_during_the_search() -> None:
    columns = {
        "found": ["0", "0", "0", "0", "1"],
        "visibility": ["", "3.3", "3.2", "1", "1.3"],
        "altitude": ["3", "3", "3", "1", "3"],
    }
    assert MEASURES["right altitude"](Rows(columns)) == 0.5
    assert math.isnan(MEASURES["right altitude"](Rows({name: cells[3:] for name, cells in columns.items()})))


def test_the_report_has_a_line_for_each_reaction_and_what_was_published() -> None:
    (configuration,) = [each for each in STUDY.configurations["corrected"] if each.key == "metacontrol.drawn"]
    assert isinstance(configuration, Configuration)
    run = RunRecord(configuration, 1, 7, 3.0, rows((1, 1.0), (2, 5.0)), (), {}, Timing(1.0, 1.0))
    report = STUDY.report(Results("corrected", [run], (), 1, "regraft evaluate suave-reactions"))
    assert "106.95 ± 39.46" in report.markdown
    assert report.files["reactions.csv"].decode().splitlines() == [
        "configuration,seed,disturbance,answered by (s),reaction (s)",
        "metacontrol.drawn,7,thruster,3,1",
        "metacontrol.drawn,7,visibility,3,2.5",
        "metacontrol.drawn,7,visibility,3,2.5",
    ]


def test_each_seed_draws_its_own_schedule_and_always_the_same() -> None:
    schedules = [str(drawn(seed)) for seed in range(50)]
    assert len(set(schedules)) == 50
    assert schedules == [str(drawn(seed)) for seed in range(50)]
