"""FROG's rounds under adaptation, five minutes at full speed: repeatable, and decided on what is told."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from itertools import groupby
from pathlib import Path
from typing import Any

import pytest

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.quality import Quality
from regraft.bus_schema.model.adaptation import AdaptationReport, Connect, Outcome
from regraft.evaluation.quality_over_time import report
from regraft.evaluation.runs.quality_run import QualityRun, run_mission
from tests.missions.robot import MISSIONS, STACKS

pytestmark = [pytest.mark.evidence, pytest.mark.timeout(3600)]

SECONDS = 300.0
FAILS_AT = 60.0


def rounds(kind: str, home: Path, *options: str, seconds: float = SECONDS) -> tuple[QualityRun, list[AdaptationReport]]:
    """Return a run of one kind of rounds, and its journal from the first adaptation on."""
    run = run_mission(STACKS / "rounds.yaml", MISSIONS / f"rounds_{kind}.xml", 1, seconds, home, options)
    assert run.closing["reproducible"] is True, (run.closing["dropped"], run.closing["problems"])
    assert run.closing["contacts"] == 0
    with closing(sqlite3.connect(home / "frog" / "journal.sqlite")) as journal:
        rows = journal.execute("SELECT report FROM adaptations ORDER BY number").fetchall()
    lines = [codec.decode(row, AdaptationReport) for (row,) in rows]
    return run, [line for line in lines if line.request.changes]


def what_counts(line: AdaptationReport) -> tuple[Any, ...]:
    """Return what must be equal of an adaptation in equal runs: all but identifiers and wall-clock durations."""
    plain = codec.to_plain(line.request)
    return line.tick, line.started, line.outcome, plain["changes"], plain["reason"], plain["actor"], plain["context"]


def disagreements(run: QualityRun, journal: list[AdaptationReport]) -> list[str]:
    """Return where a context says of a requirement what the bus did not say at that time.

    A decision is made below the requirements, and they are told after it in the same tick: what holds is what was
    told last before that time, or at it.
    """
    found = []
    told = {name: list(own) for name, own in groupby(sorted(run.qualities, key=_name), _name)}
    for line in journal:
        context = line.request.context.get("qualities", {})
        for name, own in told.items():
            before = [quality for quality in own if quality.stamp < line.started][-1:]
            possible = [_standing(quality) for quality in [*before, *(q for q in own if q.stamp == line.started)]]
            said = (name in context, context.get(name, {}).get("satisfied"))
            if possible and said not in possible:
                found.append(f"{line.started} s, {name}: the journal says {said}, the bus {possible}")
    return found


def _name(quality: Quality) -> str:
    return quality.requirement


def _standing(quality: Quality) -> tuple[bool, bool | None]:
    return quality.active, quality.satisfied if quality.active else None


@pytest.mark.parametrize("kind", ["internal", "external"])
def test_equal_seeds_adapt_equally_and_the_journal_knows_the_requirements_as_they_were_told(
    kind: str, tmp_path: Path
) -> None:
    (first, journal), (second, again) = (rounds(kind, tmp_path / str(number)) for number in range(2))
    print(report([first, second]), first.closing["digest"], len(journal), first.closing["real_time_factor"])
    assert second.closing["digest"] == first.closing["digest"]
    assert len(journal) > 10
    assert [what_counts(line) for line in again] == [what_counts(line) for line in journal]
    assert [what_counts(line) for line in first.adaptations] == [what_counts(line) for line in journal]
    by_requirement = [sorted(run.qualities, key=_name) for run in (first, second)]
    assert by_requirement[0] == by_requirement[1]
    assert disagreements(first, journal) == []
    stale = [line for line in journal if line.outcome is Outcome.REJECTED]
    assert all([violation.field for violation in line.violations] == ["revision"] for line in stale)
    assert {line.outcome for line in journal} <= {Outcome.APPLIED, Outcome.REJECTED}


@pytest.mark.parametrize("planner", ["bandits", "forecast"])
def test_equal_seeds_decide_equally_by_a_decision_file(planner: str, tmp_path: Path) -> None:
    mission = MISSIONS / f"rounds_decided_{planner}.xml"
    first, second = (
        run_mission(STACKS / "decided.yaml", mission, 1, 120.0, tmp_path / str(number)) for number in range(2)
    )
    assert first.closing["reproducible"] is True, (first.closing["dropped"], first.closing["problems"])
    assert second.closing["digest"] == first.closing["digest"]
    assert [what_counts(line) for line in first.adaptations] == [what_counts(line) for line in second.adaptations]
    assert [line for line in first.adaptations if line.request.actor.endswith(f"by {planner}")]


@pytest.mark.parametrize("failure", ["black", "frozen", "silent"])
def test_a_camera_that_fails_is_replaced_within_a_leg_and_taken_back_when_it_is_well(
    failure: str, tmp_path: Path
) -> None:
    option = f"camera.failures=[{{at: {FAILS_AT:g}, failure: {failure}}}, {{at: 120, failure: none}}]"
    run, journal = rounds("rewired", tmp_path, "--set", option, seconds=180.0)
    print(report([run]), run.camera)
    assert [line.outcome for line in journal] == [Outcome.APPLIED] * len(journal)
    away, *_, back = journal
    assert away.request.changes == (Connect("detector", "image", "corner_camera/image"),)
    assert FAILS_AT <= away.started <= FAILS_AT + 30.0
    assert back.request.changes == (Connect("detector", "image", "camera/image"),)
    assert 120.0 <= back.started <= 150.0
    assert not [event for event in run.events if event.kind == "mission.trouble"]
    assert run.closing["pictures"]["corner_camera"] > 5
