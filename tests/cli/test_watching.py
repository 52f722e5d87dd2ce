"""``--confirm`` and ``--watch``: every form, what broke, and what means nothing, in each command that takes them."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.adaptation.conditions import HOLDING, MALFORMED, UNKNOWN
from tests.cli.live import System, regraft
from tests.support.tables import check_each
from tests.support.waiting import wait_until

STACK = """\
system: tiny
clock: real
imports: [tests.adaptation.watching.gauging]
topics:
  adaptations: {type: regraft/AdaptationReport}
  architecture: {type: regraft/Architecture}
components:
  gauge: {class: 'tests.adaptation.watching.gauging:Gauge'}
  judge: {class: 'tests.faults.ledger:Judge', parameters: {until: 0.0}}
  adaptation_manager: {class: 'regraft.adaptation_manager.manager:AdaptationManager'}
modes:
  low: [{change: set_parameters, component: gauge, parameters: {shown: 1.0}}]
  high: [{change: set_parameters, component: gauge, parameters: {shown: 9.0}}]
"""
GAUGE = "tests.adaptation.watching.gauging:Gauge"
LOW = {"changes": [{"change": "set_parameters", "component": "gauge", "parameters": {"shown": 1.0}}]}
STRICT = {"changes": [{"change": "set_parameters", "component": "judge", "parameters": {"until": 1e12}}]}
"""After it, the requirement is not met any more."""
LEVEL = "{quality: gauge.level, at_least: 4}"


@pytest.fixture(scope="module")
def gauged(tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    folder = tmp_path_factory.mktemp("gauged")
    (folder / "stack.yaml").write_text(STACK)
    for name, request in (("low", LOW), ("strict", STRICT)):
        (folder / name).write_text(json.dumps(request))
    with System(folder / "home", command=("up", str(folder), "--headless")) as system:
        tried = ("mode", "high", "--dry-run", "--confirm", "0.6", "--watch", "Steady")
        wait_until(lambda: regraft(system.home, *tried).returncode == 0, "a report of the requirement")
        yield system


@pytest.fixture(autouse=True)
def _among_files(gauged: System, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(gauged.home.parent)


def _typed(condition: Any) -> str:
    """Return a condition as it is typed."""
    if isinstance(condition, str):
        return condition
    return condition["require"] if condition.keys() == {"require"} else json.dumps(condition)


def _parameters(gauged: System, component: str) -> dict[str, Any]:
    found: dict[str, Any] = {
        each["parameter"]: each["value"] for each in gauged.ask("param", "list", component)["parameters"]
    }
    return found


def test_every_form_is_taken_and_what_holds_is_applied(gauged: System) -> None:
    watch = [word for condition in HOLDING for word in ("--watch", _typed(condition))]
    report = gauged.ask("mode", "high", "--confirm", "0.6", *watch)
    assert (report["outcome"], report["broken"]) == ("applied", []), report
    assert len(report["request"]["watch"]) == len(HOLDING)
    gauged.ask("undo", report["id"])


def test_the_modes_of_all_parts_are_shown_as_json(gauged: System) -> None:
    (whole,) = [part for part in gauged.ask("mode", "show") if not part["part"]]
    assert whole["kind"] == "system"
    (gauge,) = gauged.ask("mode", "show", "gauge")
    assert (gauge["part"], gauge["kind"], gauge["state"]) == ("gauge", "component", "active")


BROKEN: list[tuple[str, str, str, str, float | None]] = [
    ("adapt low", LEVEL, "quality_out_of_bounds", "gauge.level", 1.0),
    ("mode low", "gauge.level > 4", "expression_false", "gauge.level > 4", None),
    (
        f"swap gauge {GAUGE} -p shown=2.0",
        "{quality: gauge.level, within: [4, 10]}",
        "quality_out_of_bounds",
        "gauge.level",
        2.0,
    ),
    ("adapt strict", "Steady", "requirement_broken", "Steady", None),
    ("move gauge local", "{component: gauge, state: inactive}", "wrong_state", "", None),
]


@pytest.mark.parametrize(("words", "condition", "code", "subject", "value"), BROKEN, ids=[row[0] for row in BROKEN])
def test_what_broke_is_printed_and_undone(
    gauged: System, words: str, condition: str, code: str, subject: str, value: float | None
) -> None:
    before = _parameters(gauged, "gauge"), _parameters(gauged, "judge")
    done = regraft(
        gauged.home,
        *words.split(),
        "--confirm",
        "1.5",
        "--watch",
        "{require: gauge.active}",
        "--watch",
        condition,
        "--json",
    )
    assert done.returncode == 1, done
    report = json.loads(done.stdout)
    (broken,) = report["broken"]
    assert report["outcome"] == "rolled_back"
    assert (broken["code"], broken["watch"], broken["subject"], broken["value"]) == (code, 1, subject, value), broken
    assert report["error"] == f"not confirmed: {broken['text']}"
    assert (_parameters(gauged, "gauge"), _parameters(gauged, "judge")) == before


def test_an_undo_is_watched_too_and_people_read_what_broke(gauged: System) -> None:
    applied = gauged.ask("mode", "high")
    done = regraft(gauged.home, "undo", applied["id"], "--confirm", "0.5", "--watch", "gauge.level > 8")
    assert done.returncode == 1, done
    assert "rolled back, in " in done.stdout
    assert "not confirmed: 'gauge.level > 8' must be true, but gauge.level is 5" in done.stdout
    assert "undone" in done.stdout
    assert _parameters(gauged, "gauge")["shown"] == 9.0
    gauged.ask("undo", applied["id"])


COMMANDS = ("adapt low", "mode low", f"swap gauge {GAUGE}", "move gauge local", "undo 1")


def test_a_condition_that_means_nothing_exits_with_2_by_field_and_leaves_no_trace(gauged: System) -> None:
    before = gauged.ask("journal")

    def check(row: tuple[str, tuple[Any, str, str]]) -> None:
        words, (condition, where, problem) = row
        text = _typed(condition).replace("NaN", ".nan")
        done = regraft(gauged.home, *words.split(), "--confirm", "1", "--watch", "Steady", "--watch", text)
        assert done.returncode == 2, done
        assert done.stdout == ""
        (line,) = [line for line in done.stderr.splitlines() if line.startswith("regraft: ")]
        assert line.startswith(f"regraft: --watch {text!r}: {f'{where}: ' if where else ''}"), line
        assert problem in line, line

    maps = [row for row in MALFORMED if isinstance(row[0], dict)]
    check_each([("adapt low", row) for row in maps] + [(words, maps[2]) for words in COMMANDS], check)
    check(("mode low", ("a b c", "require", "is no expression")))
    done = regraft(gauged.home, "mode", "low", "--confirm", "1", "--watch", "{quality: [")
    assert (done.returncode, done.stderr.startswith("regraft: --watch:1: is not YAML")) == (2, True), done
    assert gauged.ask("journal") == before


def test_a_condition_over_what_is_not_there_exits_with_2_and_the_nearest_name(gauged: System) -> None:
    def check(row: tuple[Any, str, str]) -> None:
        condition, where, problem = row
        done = regraft(gauged.home, "mode", "low", "--confirm", "1", "--watch", "Steady", "--watch", _typed(condition))
        assert done.returncode == 2, done
        field = ".".join(filter(None, ("watch.1", where)))
        assert any(line.startswith(f"regraft: {field}: ") and problem in line for line in done.stderr.splitlines()), (
            done
        )

    check_each(UNKNOWN, check)


def test_a_mistake_leaves_a_line_only_where_the_manager_alone_can_find_it(gauged: System) -> None:
    before = gauged.ask("journal")

    def check(row: tuple[str, tuple[Any, str, str]]) -> None:
        words, (condition, _, problem) = row
        done = regraft(gauged.home, *words.split(), "--confirm", "1", "--watch", _typed(condition))
        assert (done.returncode, problem in done.stderr, done.stdout) == (2, True, ""), done

    check_each([(words, row) for words in COMMANDS[:-1] for row in UNKNOWN if row[0] != "Stedy"], check)
    assert gauged.ask("journal") == before
    applied = gauged.ask("mode", "low")
    wrong = ("--confirm", "1", "--watch", "{component: gague, state: active}", "--json")
    done = regraft(gauged.home, "undo", applied["id"], *wrong)
    assert (done.returncode, json.loads(done.stdout)["outcome"]) == (2, "rejected"), done
    gauged.ask("undo", applied["id"])


def test_what_an_adaptation_makes_of_a_component_may_be_watched(gauged: System) -> None:
    Path("rests.yaml").write_text("changes: [{change: transition, component: gauge, transition: deactivate}]\n")
    watch = ("--confirm", "1", "--watch", "{quality: gauge.level, at_least: 1}")
    done = regraft(gauged.home, "adapt", "rests.yaml", *watch)
    assert (done.returncode, "gauge is inactive afterwards" in done.stderr) == (2, True), done
    Path("another.yaml").write_text(
        f"changes: [{{change: add, component: another, spec: {{class: '{GAUGE}'}}}}]\n"
        "confirm: 1\nwatch: [{quality: another.level, at_least: 1}]\n"
    )
    assert gauged.ask("adapt", "another.yaml", "--dry-run")["outcome"] == "pending"


def test_in_a_file_it_is_told_with_its_line(gauged: System) -> None:
    def told(condition: str) -> str:
        text = f"changes:\n  - {{change: mode, mode: low}}\nconfirm: 1\nwatch:\n  - Steady\n  - {condition}\n"
        Path("watched.yaml").write_text(text)
        done = regraft(gauged.home, "adapt", "watched.yaml")
        return f"{done.returncode} {done.stderr}"

    assert told("{quality: gauge.levle, at_least: 1}").startswith(
        "2 regraft: watched.yaml:6: watch.1.quality: gauge measures no"
    )
    assert told("{quality: gauge.level, at_leas: 1}").startswith("2 regraft: watched.yaml:6: watch.1")


def test_to_watch_without_a_time_is_refused(gauged: System) -> None:
    done = regraft(gauged.home, "mode", "low", "--watch", "Steady")
    assert (done.returncode, "watch: is of no use without 'confirm'" in done.stderr) == (2, True), done
