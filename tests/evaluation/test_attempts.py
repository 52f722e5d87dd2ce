"""Each attempt at a run is noted with its cause, and a report states how many runs were made again and why."""

from __future__ import annotations

from pathlib import Path

from regraft.evaluation.runs.attempts import LOG, Attempt, AttemptLog, Cause, Outcome, decisive, repeats_text

LOST = Cause("messages_lost", "mapper", "camera/image of camera from 4 to 4")
CRASHED = Cause("ended", "camera", "camera ended: exit code 1")


def attempt(run: str, outcome: Outcome, cause: Cause | None = None) -> Attempt:
    code, component, text = (cause.code, cause.component, cause.text) if cause else ("", "", "")
    return Attempt(run, 1, "2026-01-01 12:00:00", 3.5, outcome, code, component, text, "abc")


def test_what_is_written_is_read_and_a_line_cut_short_spoils_no_other(tmp_path: Path) -> None:
    log = AttemptLog(tmp_path)
    assert log.read() == []
    first = [attempt("a/001", Outcome.REPEATED, LOST), attempt("a/001", Outcome.KEPT)]
    for each in first:
        log.add(each)
    with (tmp_path / LOG).open("a") as file:
        file.write("a/002,1,2026")
    log.add(attempt("a/003", Outcome.FAILED, CRASHED))
    log.add(attempt("a/003", Outcome.KEPT))
    assert log.read() == [*first, attempt("a/003", Outcome.FAILED, CRASHED), attempt("a/003", Outcome.KEPT)]


def test_a_crash_counts_before_what_a_busy_machine_may_have_caused() -> None:
    assert decisive([LOST, CRASHED]) == CRASHED
    assert decisive([LOST, Cause("hung", "camera")]) == LOST
    assert (LOST.of_the_machine, CRASHED.of_the_machine) == (True, False)


def test_runs_that_were_made_again_are_counted_by_cause() -> None:
    attempts = [
        attempt("a/001", Outcome.REPEATED, LOST),
        attempt("a/001", Outcome.REPEATED, Cause("hung", "mapper")),
        attempt("a/001", Outcome.KEPT),
        attempt("a/002", Outcome.FAILED, LOST),
        attempt("a/002", Outcome.KEPT),
        attempt("a/003", Outcome.INTERRUPTED),
        attempt("a/003", Outcome.KEPT),
        attempt("a/004", Outcome.FAILED, CRASHED),
    ]
    made_again, cut_off = repeats_text(attempts, ["a/001", "a/002", "a/003"])
    assert made_again.startswith("**2 of 3 runs were made again**, after 3 failed attempts")
    assert "1 x hung (mapper), 2 x messages_lost (mapper)" in made_again
    assert cut_off.startswith("1 attempts ended with the campaign")
    assert repeats_text([attempt("a/001", Outcome.KEPT)], ["a/001"]) == ["No run failed before it was kept."]
