"""A campaign can be repeated, ended and gone on with; what fails is told, and nothing is left by half."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import threading
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
from typer.testing import CliRunner

from regraft.evaluation.campaign import Campaign, Wanted
from regraft.evaluation.results.table import read_table
from regraft.evaluation.runs import run_process
from regraft.evaluation.runs.attempts import AttemptLog, Outcome
from regraft.evaluation.runs.fingerprint import SHOWN, code_hash
from regraft.evaluation.runs.folder_lock import held
from tests.evaluation.app import command_line
from tests.evaluation.tiny import STUDY as STUDY_OF_TINY
from tests.support.frog import Load
from tests.support.paths import ROOT
from tests.support.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.slow

STUDY = "tests.evaluation.tiny:STUDY"


def run(out: Path, *options: str, study: str = STUDY) -> tuple[int, str]:
    """Return the exit code of a campaign, and what it said."""
    before = signal.getsignal(signal.SIGTERM)
    try:
        done = CliRunner().invoke(command_line(), ["evaluate", study, "--out", str(out), *options])
    finally:
        signal.signal(signal.SIGTERM, before)
    return done.exit_code, done.output


def started(out: Path, *options: str, limit: int = 0) -> subprocess.Popen[str]:
    """Start a campaign in a process of its own, in which files may have at most ``limit`` bytes, if that is given."""
    command = [sys.executable, "-m", "tests.evaluation.app", "evaluate", STUDY, "--out", str(out), *options]
    if limit:
        command = ["prlimit", f"--fsize={limit}", *command]
    return subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ}
    )


def contents(out: Path) -> dict[str, bytes]:
    """Return what must be equal for equal campaigns, by name."""
    paths = [*out.glob("runs/**/rows.csv"), *out.glob("runs/**/adaptations.csv"), *out.glob("note.txt")]
    return {path.relative_to(out).as_posix(): path.read_bytes() for path in paths}


def table(out: Path) -> list[str]:
    return [line for line in (out / "report.md").read_text().splitlines() if line.startswith("|")]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a campaign that has ended, two runs at a time."""
    out = tmp_path_factory.mktemp("whole")
    assert run(out, "--parallel", "2")[0] == 0
    return out


@pytest.fixture
def copied(whole: Path, tmp_path: Path) -> Path:
    """Return a copy of the campaign that has ended."""
    return shutil.copytree(whole, tmp_path / "copied")


def test_every_configuration_is_run_with_every_seed(whole: Path) -> None:
    files = [
        f"runs/{key}/00{n}/{name}.csv" for key in ("slow", "fast") for n in (1, 2) for name in ("rows", "adaptations")
    ]
    assert sorted(contents(whole)) == sorted(["note.txt", *files])
    rows = (whole / "runs" / "slow" / "001" / "rows.csv").read_text().splitlines()
    assert rows[0] == "time,number,heard,even"
    assert len(rows) >= 4
    assert (whole / "runs" / "slow" / "001" / "timing.csv").read_text().startswith("what,time,wall_s\nstartup,,")


def test_the_stack_as_it_was_run_can_be_run_again(whole: Path) -> None:
    text = (whole / "runs" / "fast" / "001" / "stack" / "as_run.yaml").read_text()
    assert "stride: 2.0" in text
    assert "CountRecorder" in text


def begins(out: Path, pattern: str) -> bool:
    """Tell whether there is the folder of a run."""
    return any(out.glob(pattern))


def test_killed_at_any_point_it_goes_on_and_equal_campaigns_are_equal_byte_for_byte(
    whole: Path, tmp_path: Path
) -> None:
    """The other campaign made two runs at a time, this one makes one after the other."""
    killed = tmp_path / "killed"
    for number, how in enumerate((signal.SIGKILL, signal.SIGINT, signal.SIGTERM)):
        process = started(killed, *(["--resume"] if number else []))
        wait_until(partial(begins, killed, f"runs/*/00{1 + number // 2}"), "a run begins", 60.0)
        process.send_signal(how)
        process.communicate(timeout=2 * PATIENCE)
        for found in killed.glob("runs/*/*"):
            assert (found / "run.json").is_file()
    code, said = run(killed, "--resume")
    assert code == 0, said
    assert contents(killed) == contents(whole)
    assert table(killed) == table(whole)
    assert not (killed / "work").exists()
    assert "No run failed before it was kept" in (killed / "report.md").read_text()


def test_attempts_that_a_killed_campaign_left_are_counted(copied: Path) -> None:
    shutil.rmtree(copied / "runs" / "slow" / "001")
    (copied / "work" / "slow-001").mkdir(parents=True)
    assert run(copied, "--resume")[0] == 0
    assert "- 1 attempts ended with the campaign, and were made again" in (copied / "report.md").read_text()


def test_a_run_that_fails_is_told_kept_and_tried_again(tmp_path: Path) -> None:
    code, said = run(tmp_path, "--definitions", "hard")
    assert code == 1
    assert "breaking/002, seed 2: FAILED" in said
    assert "1 of 2 runs, 1 failed" in said
    report = (tmp_path / "report.md").read_text()
    assert "**1 runs failed**" in report
    assert "- breaking, seed 2: exit code 2: " in report
    assert "sideways" in report
    assert "sideways" in (tmp_path / "failed" / "breaking" / "002" / "up.log").read_text()
    assert run(tmp_path, "--definitions", "hard", "--resume")[0] == 1
    assert (tmp_path / "runs" / "breaking" / "001").is_dir()


def test_more_runs_and_configurations_can_be_added_but_not_other_ones(tmp_path: Path) -> None:
    assert run(tmp_path, "--runs", "1", "--configurations", "slow")[0] == 0
    code, said = run(tmp_path, "--runs", "1")
    assert (code, "continue with --resume" in said) == (2, True)
    code, said = run(tmp_path, "--runs", "1", "--seed", "7", "--resume")
    assert (code, "seed was 1" in said) == (2, True)
    assert run(tmp_path, "--runs", "1", "--resume")[0] == 0
    assert sorted(path.name for path in (tmp_path / "runs").iterdir()) == ["fast", "slow"]


@pytest.mark.parametrize("part", ["code", "stack", "files"])
def test_runs_of_other_code_or_stacks_are_not_mixed_with(copied: Path, part: str) -> None:
    about = copied / "runs" / "slow" / "001" / "run.json"
    made = json.loads(about.read_text())
    made["fingerprint"][part] = "0" * 64
    about.write_text(json.dumps(made))
    code, said = run(copied, "--resume")
    assert code == 2
    assert f"was made with other {part} (hash 000000000000 then" in said
    assert "name another --out" in said
    code, _ = run(copied, "--resume", "--configurations", "fast")
    assert code == 2, "nor are those of another configuration"


def test_a_mere_report_states_of_which_code_its_runs_are(whole: Path, copied: Path) -> None:
    assert f"- 4 runs were made with code `{code_hash(['tests'])[:SHOWN]}`." in (whole / "report.md").read_text()
    for name in ("slow/001", "fast/001"):
        about = copied / "runs" / name / "run.json"
        made = json.loads(about.read_text())
        made["fingerprint"] = made["fingerprint"] | {"code": "0" * 64} if name.startswith("slow") else "as it was once"
        about.write_text(json.dumps(made))
    assert run(copied, "--report-only")[0] == 0
    report = (copied / "report.md").read_text()
    assert "- 1 runs were made with code `000000000000`, which is" in report
    assert "- 1 runs were made with code of which there is no record." in report
    assert "**The runs are not of one code**" in report


def test_what_is_finished_is_reported_whatever_is_asked_for(whole: Path, copied: Path) -> None:
    code, said = run(copied, "--report-only", "--runs", "1")
    assert code == 2
    assert "has finished runs up to 002: give --runs 2" in said
    assert run(copied, "--resume", "--configurations", "fast")[0] == 0
    assert (copied / "results.csv").read_text().count("\n") == (whole / "results.csv").read_text().count("\n")


def test_a_failed_run_is_reported_whatever_is_asked_for(copied: Path) -> None:
    failed = copied / "failed" / "slow" / "002"
    shutil.rmtree(copied / "runs" / "slow" / "002")
    failed.mkdir(parents=True)
    (failed / "why.txt").write_text("exit code 2: it is broken\n")
    code, _ = run(copied, "--report-only", "--configurations", "fast")
    assert code == 1
    assert "- slow, seed 2: exit code 2: it is broken" in (copied / "report.md").read_text()


def test_a_folder_has_one_campaign_at_a_time(copied: Path) -> None:
    with held(copied):
        code, said = run(copied, "--resume")
        assert run(copied, "--report-only")[0] == 0
    assert code == 2
    assert f"in use by another campaign (process {os.getpid()}, since 20" in said
    assert "name another --out" in said
    assert run(copied, "--resume")[0] == 0


@pytest.mark.evidence
def test_a_run_beside_busy_loops_does_not_fail_and_is_the_one_made_alone(whole: Path, tmp_path: Path) -> None:
    with Load(4, apart=True):
        code, said = run(tmp_path, "--runs", "1", "--configurations", "slow")
    assert code == 0, said
    assert [each.outcome for each in AttemptLog(tmp_path).read()] == [Outcome.KEPT]
    assert contents(tmp_path).items() - contents(whole).items() == set()


def progress_of(stack: Path, out: Path) -> set[str]:
    """Run the study's first run with another stack file; return how far it was seen to be."""
    study = replace(STUDY_OF_TINY, stack=stack)
    wanted = Wanted(study, "plain", tuple(study.configurations["plain"][:1]), 1, 1, study.seconds)
    campaign, seen = Campaign(wanted, out), set[str]()
    with campaign.opened(resume=False):
        campaign.run(lambda progress: seen.update(progress.running), lambda _: None)
    assert len(campaign.results().runs) == 1
    return seen & {f"slow/001 at {second} s" for second in range(1, 5)}


def test_a_run_is_watched_by_its_rows_also_where_the_stack_has_its_name_from_another_file(tmp_path: Path) -> None:
    shutil.copy(ROOT / "tests" / "evaluation" / "tiny.yaml", tmp_path)
    including = tmp_path / "including.yaml"
    including.write_text("include: [tiny.yaml]\n")
    assert progress_of(including, tmp_path / "out")


def test_a_run_is_watched_by_its_rows_whichever_system_the_user_has_chosen(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("REGRAFT_SYSTEM", "elsewhere")
    assert progress_of(STUDY_OF_TINY.stack, tmp_path)


def test_a_campaign_ends_where_what_its_runs_are_made_of_changes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, stack = tmp_path / "out", tmp_path / "stack"
    stack.mkdir()
    shutil.copy(ROOT / "tests" / "evaluation" / "tiny.yaml", stack)
    monkeypatch.setattr("tests.evaluation.tiny.MOVED", replace(STUDY_OF_TINY, stack=stack / "tiny.yaml"), raising=False)

    def change() -> None:
        wait_until(partial(begins, out, "work/*/up.json"), "a run begins", 60.0)
        (stack / "mission.xml").write_text("<root/>")

    changing = threading.Thread(target=change)
    changing.start()
    code, said = run(out, "--runs", "1", study="tests.evaluation.tiny:MOVED")
    changing.join()
    assert code == 1
    assert "slow/001 was made with other files (hash" in said
    assert not list(out.glob("runs/*/*"))


def test_a_run_that_the_machine_may_have_made_fail_is_made_again_twice_at_most(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run_process, "STARTED_TIMEOUT", 0.0)
    code, said = run(tmp_path, "--runs", "1", "--configurations", "slow")
    assert code == 1
    assert said.count("to be made again") == 2
    assert "slow/001, seed 1: FAILED: no first row" in said
    monkeypatch.undo()
    assert run(tmp_path, "--runs", "1", "--configurations", "slow", "--resume")[0] == 0
    report = (tmp_path / "report.md").read_text()
    assert "**1 of 1 runs were made again**, after 3 failed attempts: 3 x not_started." in report
    outcomes = [each.outcome for each in AttemptLog(tmp_path).read()]
    assert outcomes == [Outcome.REPEATED, Outcome.REPEATED, Outcome.FAILED, Outcome.KEPT]


def test_a_run_of_which_a_process_crashed_is_not_made_again_and_named_by_that(tmp_path: Path) -> None:
    code, said = run(tmp_path, "--runs", "1", "--definitions", "deadly")
    assert code == 1
    assert "crashing/001, seed 1: FAILED: exit code 1: counter is quarantined; ended (counter): counter ended" in said
    (attempt,) = AttemptLog(tmp_path).read()
    assert (attempt.outcome, attempt.cause, attempt.component) == (Outcome.FAILED, "ended", "counter")


def test_arms_with_and_without_pictures_are_of_one_study_and_those_of_other_renderers_are_not(tmp_path: Path) -> None:
    seeing = ("--definitions", "seeing", "--runs", "1")
    assert run(tmp_path, *seeing, "--configurations", "camera,lidar,stereo")[0] == 0
    assert [each.renderer for each in read_table(tmp_path / "results.csv").rows] == ["ray", "", "ray"]
    code, said = run(tmp_path, *seeing, "--configurations", "other", "--resume")
    assert (code, "another renderer (ray in other runs, egl in this one)" in said) == (1, True)


def test_a_run_with_faults_on_a_schedule_is_kept_and_repeated(tmp_path: Path) -> None:
    for out in (tmp_path / "one", tmp_path / "other"):
        assert run(out, "--runs", "1", "--definitions", "disturbed")[0] == 0
    about = json.loads((tmp_path / "one" / "runs" / "killed" / "001" / "run.json").read_text())
    assert about["closing"]["restarts"] == 1
    assert contents(tmp_path / "one") == contents(tmp_path / "other")


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--definitions", "plane"], "did you mean 'plain'?"),
        (["--configurations", "slow,fats"], "did you mean 'fast'?"),
        (["--runs", "0"], "--runs"),
        (["--parallel", "0"], "--parallel"),
        (["--for", "0"], "--for"),
        (["--report-only"], "there is no campaign in"),
    ],
)
def test_a_bad_argument_is_told_and_nothing_is_begun(options: list[str], told: str, tmp_path: Path) -> None:
    code, said = run(tmp_path / "out", *options)
    assert code == 2
    assert told in said
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("study", "told"),
    [
        ("frog-architectur", "did you mean 'frog-architecture'?"),
        ("tests.evaluation.tiny:STUDIE", "no study at 'tests.evaluation.tiny:STUDIE'"),
        ("tests.evaluation.tiny:ADDITIONS", "must be a Study"),
    ],
)
def test_an_unknown_study_is_told(study: str, told: str, tmp_path: Path) -> None:
    code, said = run(tmp_path / "out", study=study)
    assert code == 2
    assert told in said


def test_without_room_it_says_so_and_leaves_no_half_of_a_table(tmp_path: Path) -> None:
    process = started(tmp_path, "--runs", "1", limit=40)
    _, complaints = process.communicate(timeout=2 * PATIENCE)
    assert process.returncode == 1
    assert "cannot write" in complaints
    assert "Traceback" not in complaints
    assert not list(tmp_path.glob("runs/*/*"))
    assert not (tmp_path / "report.md").exists()


def test_a_stack_that_cannot_be_copied_is_told_by_its_file(tmp_path: Path) -> None:
    process = started(tmp_path, "--runs", "1", limit=130)
    _, complaints = process.communicate(timeout=2 * PATIENCE)
    assert process.returncode == 1
    assert "tiny.yaml" in complaints
    assert "None" not in complaints


def test_a_run_ends_with_the_last_row_of_a_recorder_that_may_end(tmp_path: Path) -> None:
    study = "tests.evaluation.tiny:ENDING"
    for out in (tmp_path / "one", tmp_path / "other"):
        assert run(out, "--runs", "1", "--configurations", "slow", study=study)[0] == 0
    assert contents(tmp_path / "one") == contents(tmp_path / "other")
    rows = (tmp_path / "one" / "runs" / "slow" / "001" / "rows.csv").read_text().splitlines()
    assert [row.rpartition(",")[2] for row in rows] == ["over", "0", "0", "1"]


def claimed(claims: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Return the name of the study with a file of claims."""
    monkeypatch.setattr(
        "tests.evaluation.tiny.CLAIMED", replace(STUDY_OF_TINY, claims={"plain": claims}), raising=False
    )
    return "tests.evaluation.tiny:CLAIMED"


def test_a_mistake_in_the_claims_is_told_before_the_first_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "claims.yaml").write_text("study: huge\n")
    code, said = run(tmp_path / "out", study=claimed(tmp_path / "claims.yaml", monkeypatch))
    assert (code, "these are the claims of 'tiny'" in said) == (2, True), said
    assert not (tmp_path / "out").exists()


def test_runs_for_tuning_need_no_claims(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study, out = claimed(tmp_path / "claims.yaml", monkeypatch), tmp_path / "out"
    code, said = run(out, "--seeds", "tuning", study=study)
    assert (code, "claims.yaml" in said, out.exists()) == (2, True, False), "their seeds are asked for"
    code, said = run(out, "--runs", "1", "--configurations", "slow", study=study)
    assert (code, said.count("claims.yaml: the study's claims are not written yet")) == (0, 1), said
    assert [each.use for each in read_table(out / "results.csv").rows] == [""]
    assert "Verdicts" not in (out / "report.md").read_text()
