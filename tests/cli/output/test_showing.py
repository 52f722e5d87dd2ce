"""What people read: lines, tables, rates, logs, the closing line."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from importlib.metadata import EntryPoint
from io import BytesIO, TextIOWrapper
from pathlib import Path

import pytest
import typer
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from regraft.bus_schema.messages.evaluation import RunSummary
from regraft.bus_schema.messages.health import Event
from regraft.bus_schema.messages.mission import MissionNode, MissionState, MissionStatus, NodeStatus
from regraft.bus_schema.messages.power import BatteryState
from regraft.bus_schema.messages.protocol.clock import CauseCode, ClockTime, RunCause
from regraft.bus_schema.messages.quality import Quality
from regraft.bus_schema.model.adaptation import (
    AdaptationReport,
    AdaptationRequest,
    Outcome,
    Unreached,
    UnreachedCode,
    Violation,
)
from regraft.cli.adaptation.managing import headline, show_report
from regraft.cli.adaptation.mistakes import violation_line
from regraft.cli.bus.rates import Rates
from regraft.cli.extensions import add_extensions
from regraft.cli.main import build
from regraft.cli.system.closing import Closing, plain_summary
from regraft.cli.system.display import display, event_line, status_line
from regraft.cli.system.logs import grown, tail
from regraft.cli.system.ps import remark, shown_state
from regraft.cli.terminal import standard_streams
from regraft.cli.terminal.output import harmless, plain_table, say, show_json
from regraft.client import TopicSample
from regraft.services.bt_executor.authors.showing import tree_lines
from regraft.services.bt_executor.command_line import quality_line
from tests.cli.conftest import Regraft

CLOCK = ClockTime(40, 2_000_000_000, 9.8, ("a",))

cells = st.text(st.characters(codec="ascii", exclude_categories=["Cc"]), max_size=12)


@given(st.lists(st.tuples(cells, cells, cells), max_size=6))
def test_a_piped_table_has_a_line_per_row_with_every_cell_whole(rows: list[tuple[str, str, str]]) -> None:
    lines = plain_table(("one", "two", "three"), rows)
    assert len(lines) == len(rows) + 1
    assert all(cell.strip() in line for row, line in zip(rows, lines[1:], strict=True) for cell in row)
    assert all(line == line.rstrip() for line in lines)


@given(st.text())
def test_what_others_wrote_is_nothing_that_a_terminal_obeys(text: str) -> None:
    shown = harmless(text)
    assert all(c.isprintable() or c in "\n\t" for c in shown)
    if text.isprintable():
        assert shown == text


def test_a_harmless_text_shows_what_was_taken_out(capsys: pytest.CaptureFixture[str]) -> None:
    say("red\x1b[31m, reversed\u202e, bell\x07")
    assert capsys.readouterr().out == "red\\x1b[31m, reversed\\u202e, bell\\x07\n"


@pytest.mark.parametrize("compact", [False, True])
def test_json_is_whole_and_nothing_that_a_terminal_obeys(capsys: pytest.CaptureFixture[str], compact: bool) -> None:
    value = {"text": 'clear\x9b2J, "reversed\u202e", tag\U000e0001, é, 光, a\\u0041'}
    show_json(value, compact=compact)
    shown = capsys.readouterr().out
    assert all(c.isprintable() or c == "\n" for c in shown)
    assert "é, 光" in shown
    assert json.loads(shown) == value


@pytest.mark.parametrize("encoding", ["latin-1", "cp1252", "utf-8"])
def test_a_character_that_standard_output_lacks_is_shown_as_an_escape(
    monkeypatch: pytest.MonkeyPatch, encoding: str
) -> None:
    written, errors = (TextIOWrapper(BytesIO(), encoding, write_through=True) for _ in range(2))
    for name, stream in (("stdin", sys.stdin), ("stdout", written), ("stderr", errors)):
        monkeypatch.setattr(sys, name, stream)
    standard_streams.prepare()
    text = "é, \u2192, \U0001f438, \x80"
    display(headless=True, quiet=False).line(text)
    show_json({"text": text}, compact=True)
    show_json({"text": text}, compact=True, err=True)
    sys.stdout.flush()
    line, document = written.buffer.getvalue().decode(encoding).splitlines()
    assert line == (text if encoding == "utf-8" else "é, \\u2192, \\U0001f438, \x80").replace("\x80", "\\x80")
    for shown in (document, errors.buffer.getvalue().decode(encoding)):
        assert json.loads(shown) == {"text": text}


def test_an_event_is_one_line_that_names_its_subject_once() -> None:
    event = Event(1.0, "component.restarted", "camera", "camera ended: exit code 1;\nit is restarted")
    line = event_line(event, CLOCK)
    assert "\n" not in line
    assert line.count("camera") == 1
    assert line.split()[:2] == ["2.00", "s"]
    assert "gateway: ready" in event_line(Event(1.0, "gateway.ready", "gateway", "ready"), None)


def test_the_live_line_says_time_speed_mission_and_battery() -> None:
    mission = MissionStatus(2.0, MissionState.RUNNING, "Frog", 3, running=("Look::19/NavigateTo::14", "Detect::23"))
    battery = BatteryState(2.0, 5.0, 10.0, 0.5, 1.0)
    line = status_line(CLOCK, {"": mission}, {"": battery}, 1.0)
    for part in ("2.0 s", "9.8 x", "running: Detect", "battery 50%"):
        assert part in line
    assert status_line(None, {}, {}, 3.0) == "3 s"
    line = status_line(CLOCK, {"left": mission, "right": mission}, {"left": battery, "right": battery}, 1.0)
    for robot in ("left", "right"):
        assert f"{robot} mission running: Detect" in line
        assert f"{robot} battery 50%" in line


def closing(**changes: object) -> Closing:
    given = {
        "system": "frog",
        "simulated_s": 20.0,
        "wall_s": 2.0,
        "startup_s": 1.0,
        "renderer": "egl",
        "reproducible": True,
        "dropped": (),
        "restarts": 0,
        "problems": (),
        "summary": {"stamp": 20.0, "digest": "0123456789abcdef", "visits": {"box": 1}, "contacts": 0},
    }
    return Closing(**{**given, **changes})  # type: ignore[arg-type]


def test_the_closing_line_says_how_fast_what_drew_and_the_digest() -> None:
    line = closing().line()
    for part in (
        "20 s simulated in 2.0 s",
        "10.0 x real time",
        "renderer egl",
        "digest 0123456789ab",
        "{box: 1}",
    ):
        assert part in line
    assert "\n" not in line
    assert "not reproducible" in closing(reproducible=False).line()
    cause = RunCause(CauseCode.HUNG, "camera", 3.0, "silent")
    assert "not reproducible, hung: camera" in closing(reproducible=False, causes=(cause,)).line()
    assert closing(causes=(cause,)).plain()["causes"] == [
        {"code": "hung", "component": "camera", "stamp": 3.0, "text": "silent"}
    ]
    assert "camera is quarantined" in closing(problems=("camera is quarantined",)).line()
    assert closing(simulated_s=None, summary={}).line().startswith("frog: ran 2.0 s")


def test_the_closing_object_has_what_scripts_need() -> None:
    plain = closing().plain()
    assert plain["real_time_factor"] == 10.0
    assert plain["digest"] == "0123456789abcdef"
    assert closing(summary={}).plain()["digest"] is None
    assert closing(wall_s=0.0).plain()["real_time_factor"] is None


def component(**changes: object) -> dict[str, object]:
    plain = {
        "process": "running",
        "alive": True,
        "state": "active",
        "silent_s": 0.1,
        "error": "",
        "failure": "",
        "detail": "",
    }
    return {**plain, "exit_reason": "", "lost": 0, "refused": 0, **changes}


def test_a_component_is_shown_as_its_process_is_where_that_does_not_run() -> None:
    assert shown_state(component()) == "active"
    assert shown_state(component(process="quarantined", alive=False)) == "quarantined"
    assert shown_state(component(process=None, alive=False)) == "gone"
    assert shown_state(component(state=None)) == "starting"


def test_a_remark_begins_with_the_worst() -> None:
    text = remark(component(silent_s=3.0, error="broken", detail="turning", lost=2))
    assert text == "silent for 3.0 s; broken; turning; 2 messages lost"


def test_a_report_is_headed_by_its_outcome_and_says_every_violation() -> None:
    report = AdaptationReport("7", Outcome.APPLIED, AdaptationRequest(()), 3, 4, 0.0, 0.012)
    assert headline(report) == "adaptation 7 applied, revision 3 to 4, in 12 ms"
    violation = Violation(1, "navigator", "parameters.max_velocity", "9: must be at most 0.26 m/s")
    assert violation_line(violation) == "change 1: navigator.parameters.max_velocity: 9: must be at most 0.26 m/s"
    assert violation_line(Violation(None, "", "", "the journal is full")) == "the journal is full"


def test_a_report_names_each_component_that_was_not_reached_and_why(capsys: pytest.CaptureFixture[str]) -> None:
    lost = Unreached("battery", UnreachedCode.HOST_LOST, "edge", "its host 'edge' is lost")
    report = AdaptationReport("7", Outcome.APPLIED, AdaptationRequest(()), 3, 4, 0.0, 0.012, unreached=(lost,))
    show_report(report, as_json=False)
    assert capsys.readouterr().out.splitlines()[1:] == ["  not reached: battery: its host 'edge' is lost"]
    show_report(report, as_json=True)
    (shown,) = json.loads(capsys.readouterr().out)["unreached"]
    assert (shown["component"], shown["code"], shown["host"]) == ("battery", "host_lost", "edge")


def test_a_tree_is_indented_by_depth() -> None:
    nodes = (
        MissionNode(1, 0, "root", "Sequence", "root", NodeStatus.RUNNING),
        MissionNode(2, 1, "Detect", "Detect", "root/Detect", NodeStatus.SUCCESS),
        MissionNode(3, 1, "drive", "NavigateTo", "root/drive", NodeStatus.RUNNING),
    )
    assert tree_lines(nodes) == [
        "> root (Sequence)  running",
        "+   Detect  success",
        ">   drive (NavigateTo)  running",
    ]


def test_a_quality_requirement_is_one_line() -> None:
    met = Quality(1.0, "MoveSafely", "Safety", metric=0.4567, satisfied=True, status="satisfied")
    assert quality_line(met) == "MoveSafely (Safety): satisfied, metric 0.457"
    unknown = Quality(1.0, "SaveEnergy", "Power", reason="no data", active=False)
    assert quality_line(unknown) == "SaveEnergy (Power): unknown, no data, not active"


@given(st.lists(st.integers(1, 5), min_size=2, max_size=30), st.floats(0.001, 10.0))
def test_rates_count_messages_and_what_is_missing_between_them(steps: list[int], period: float) -> None:
    rates = Rates()
    sequence = 0
    for index, step in enumerate(steps):
        sequence += step
        stamp = round(index * period * 1e9)
        rates.add(index * period, TopicSample("t", "a/B@1", "s", 1, sequence, stamp, 10, {}))
    plain = rates.plain()
    assert plain["count"] == len(steps)
    assert plain["missing"] == sum(step - 1 for step in steps[1:])
    assert plain["hz"] == pytest.approx(1 / period)
    assert plain["stamp_hz"] == pytest.approx(1 / period, rel=1e-3)


lines = st.lists(st.text(st.characters(codec="ascii", exclude_categories=["Cc"]), max_size=20), max_size=20)


@given(before=lines, after=lines, rest=cells, count=st.integers(1, 30))
def test_following_a_log_shows_every_line_once(
    tmp_path_factory: pytest.TempPathFactory, before: list[str], after: list[str], rest: str, count: int
) -> None:
    path = tmp_path_factory.mktemp("logs") / "a.log"
    path.write_text("".join(f"{line}\n" for line in before) + rest)
    shown, position = tail(path, count)
    assert shown == before[-count:]
    with path.open("a") as log:
        log.write("\n" + "".join(f"{line}\n" for line in after))
    more, position = grown(path, position)
    assert more == [rest, *after]
    assert grown(path, position) == ([], position)


def test_a_log_is_shown_with_a_last_line_that_has_no_end_yet(regraft: Regraft, home: Path) -> None:
    logs = home / "tiny" / "logs"
    logs.mkdir(parents=True)
    (logs / "talker.log").write_text("first\nfatal: no")
    assert regraft("logs", "talker", "--system", "tiny").stdout == "first\nfatal: no\n"
    assert json.loads(regraft("logs", "talker", "--system", "tiny", "--json").stdout)["lines"] == ["first", "fatal: no"]


def test_a_log_that_was_begun_anew_is_shown_from_its_start(tmp_path: Path) -> None:
    path = tmp_path / "a.log"
    path.write_text("a long first line\n")
    _, position = tail(path, 10)
    path.write_text("new\n")
    assert grown(path, position)[0] == ["new"]


def hello(name: str) -> None:
    """Greet."""
    typer.echo(f"hello {name}")


def test_commands_of_other_packages_are_added_and_broken_ones_left_out() -> None:
    app = build()
    found = (
        EntryPoint("hello", f"{__name__}:hello", "regraft.commands"),
        EntryPoint("broken", "no_such_module:app", "regraft.commands"),
    )
    add_extensions(app, found)
    assert CliRunner().invoke(app, ["hello", "frog"]).stdout == "hello frog\n"
    assert CliRunner().invoke(app, ["broken"]).exit_code == 2


ANY_TEXTS = ("0c", "sha256:0c", "sha256:0d", "q83vEjRW==", "")
"""Digests of an author's recorders."""


def test_the_summaries_of_several_recorders_are_summed_up_by_robot() -> None:
    left = RunSummary(20.0, "0a", 400, 1, 2.5, {"north": 2}, {"left/camera": 3}, {"left/camera": 1}, {})
    right = replace(left, ticks=399, contacts=0, distance=1.0, visits={"south": 1}, pictures={}, hits={})
    shared = RunSummary(20.0, "0b", 0, 0, 0.0, {}, {}, {}, {"applied": 2})
    told = {"left.recorder": left, "recorder": shared, "right.recorder": right}
    found = plain_summary(told)
    assert (found["ticks"], found["contacts"], found["distance"]) == (400, 1, 3.5)
    assert found["visits"] == {"left/north": 2, "right/south": 1}
    assert (found["pictures"], found["hits"]) == ({"left/camera": 3}, {"left/camera": 1})
    assert found["adaptations"] == {"applied": 2}
    assert found["summaries"]["right.recorder"]["distance"] == 1.0
    assert found["digest"] != plain_summary(told | {"left.recorder": replace(left, digest="0c")})["digest"]
    joint = {plain_summary(told | {"left.recorder": replace(left, digest=text)})["digest"] for text in ANY_TEXTS}
    assert len(joint) == len(ANY_TEXTS)
    assert found["digest"] == "d6e314b9d4e5c46fc5a8684c2a0eac9c621967a93f157f88801fe2b849f44999"
    assert plain_summary({"recorder": left})["digest"] == "0a"
    assert plain_summary({}) == {}
    assert "summaries" not in closing(summary=found).line()
