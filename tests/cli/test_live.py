"""A real system of processes, and every command that looks at it or changes it."""

from __future__ import annotations

import json
import subprocess
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.cli.live import STACK, System, regraft
from tests.support.commands import REGRAFT, Command, in_home
from tests.support.machine.processes import kill, wait_gone
from tests.support.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.slow


def test_ps_lists_every_component_with_its_process(tiny: System) -> None:
    found = tiny.components()
    assert sorted(found) == ["adaptation_manager", "listener", "talker"]
    assert {component["state"] for component in found.values()} == {"active"}
    assert len({component["pid"] for component in found.values()}) == 3
    assert "talker" in regraft(tiny.home, "ps").stdout


def test_a_second_up_of_the_same_system_exits_with_2(tiny: System) -> None:
    found = regraft(tiny.home, "up", str(STACK))
    assert found.returncode == 2
    assert "already running" in found.stderr


def test_a_parameter_that_was_set_is_what_get_and_list_say(tiny: System) -> None:
    report = tiny.ask("param", "set", "talker", "step", "2.5", "--reason", "to see")
    assert report["outcome"] == "applied"
    assert tiny.ask("param", "get", "talker", "step")["value"] == 2.5
    rows = tiny.ask("param", "list", "talker")["parameters"]
    assert {row["parameter"]: row["value"] for row in rows}["step"] == 2.5
    listed = regraft(tiny.home, "param", "list").stdout
    assert all(f"{name}" in listed for name in ("adaptation_manager", "listener", "talker", "step"))


def test_a_negative_value_is_typed_as_it_is(tiny: System) -> None:
    before = tiny.ask("param", "get", "listener", "offset")["value"]
    report = tiny.ask("param", "set", "listener", "offset", "-1.5", "--reason", "below")
    assert tiny.ask("param", "get", "listener", "offset")["value"] == -1.5
    tiny.ask("undo", report["id"])
    assert tiny.ask("param", "get", "listener", "offset")["value"] == before


def test_values_that_do_not_fit_are_all_told_and_never_asked_for(tiny: System) -> None:
    before = tiny.ask("journal")
    found = regraft(tiny.home, "param", "set", "talker", "step=11", "rate=1000")
    assert found.returncode == 2
    assert "at most 10.0 m" in found.stderr
    assert "at most 100.0 Hz" in found.stderr
    assert tiny.ask("journal") == before


def test_a_rejected_change_exits_with_1_and_says_why(tiny: System) -> None:
    found = regraft(tiny.home, "lifecycle", "set", "talker", "activate")
    assert found.returncode == 1
    assert "rejected" in found.stdout
    assert "active" in found.stderr


def test_an_adaptation_can_be_tried_applied_and_undone(tiny: System, tmp_path: Path) -> None:
    before = tiny.ask("param", "get", "listener", "offset")["value"]
    change = {"change": "set_parameters", "component": "listener", "parameters": {"offset": before + 1}}
    file = tmp_path / "request.json"
    file.write_text(json.dumps({"changes": [change]}))
    assert tiny.ask("adapt", str(file), "--dry-run")["request"]["dry_run"]
    assert tiny.ask("param", "get", "listener", "offset")["value"] == before
    report = tiny.ask("adapt", str(file), "--reason", "why not")
    assert tiny.ask("param", "get", "listener", "offset")["value"] == before + 1
    assert tiny.ask("journal", "show", report["id"])["request"]["reason"] == "why not"
    assert tiny.ask("journal", "show", report["id"])["differences"][0]["path"].startswith("/components/listener")
    revisions = str(report["revision_before"]), str(report["revision_after"])
    changed = tiny.ask("journal", "diff", *revisions)["differences"]
    assert changed == tiny.ask("journal", "show", report["id"])["differences"]
    assert tiny.ask("journal", "diff", revisions[0], revisions[0])["differences"] == []
    late = regraft(tiny.home, "undo", report["id"], "--if-revision", revisions[0])
    assert late.returncode == 1
    assert "revision" in late.stderr
    assert tiny.ask("undo", report["id"], "--if-revision", revisions[1])["outcome"] == "applied"
    assert tiny.ask("param", "get", "listener", "offset")["value"] == before


def test_a_component_is_swapped_while_it_works_and_back_again(tiny: System) -> None:
    before = tiny.components()["talker"]
    assert tiny.ask("swap", "talker", "-p", "step=3", "--dry-run")["request"]["dry_run"]
    report = tiny.ask("swap", "talker", "-p", "step=3", "--reason", "to see")
    assert report["outcome"] == "applied"
    after = tiny.components()["talker"]
    assert (after["state"], after["incarnation"]) == ("active", before["incarnation"] + 1)
    assert tiny.ask("param", "get", "talker", "step")["value"] == 3
    assert tiny.ask("undo", report["id"])["outcome"] == "applied"
    assert tiny.ask("param", "get", "talker", "step")["value"] != 3
    found = regraft(tiny.home, "swap", "talker", "tiny_parts:Nobody")
    assert found.returncode == 2
    assert "has no class 'Nobody'" in found.stderr
    found = regraft(tiny.home, "move", "talker", "elsewhere")
    assert "there is no host 'elsewhere'" in found.stderr


def test_a_stale_revision_is_refused(tiny: System, tmp_path: Path) -> None:
    change = {"change": "set_parameters", "component": "talker", "parameters": {"step": 1.0}}
    (tmp_path / "request.json").write_text(json.dumps({"changes": [change]}))
    found = regraft(tiny.home, "adapt", str(tmp_path / "request.json"), "--if-revision", "999")
    assert found.returncode == 1
    assert "revision" in found.stderr


def test_a_component_can_be_deactivated_and_activated_again(tiny: System) -> None:
    tiny.ask("lifecycle", "set", "listener", "deactivate")
    assert tiny.ask("lifecycle", "get", "listener")["state"] == "inactive"
    tiny.ask("lifecycle", "set", "listener", "activate")
    assert tiny.ask("lifecycle", "get", "listener")["state"] == "active"


def test_topics_can_be_listed_echoed_and_measured(tiny: System) -> None:
    topics = {topic["name"]: topic for topic in tiny.ask("topic", "list")["topics"]}
    assert topics["number"]["writers"] == ["talker.number"]
    assert topics["number"]["readers"] == ["listener.number"]
    shown = regraft(tiny.home, "topic", "echo", "number", "--count", "3", "--json").stdout
    samples = [json.loads(line) for line in shown.splitlines()]
    numbers = [sample["sequence"] for sample in samples]
    assert numbers == list(range(numbers[0], numbers[0] + 3))
    assert tiny.ask("topic", "hz", "number", "--count", "10")["missing"] == 0


def test_echo_of_a_silent_topic_ends_in_time_and_exits_with_1(tiny: System) -> None:
    found = regraft(tiny.home, "topic", "echo", "spare", "--once", "--for", "0.2")
    assert found.returncode == 1
    assert "spare has no writer" in found.stderr


def test_a_service_can_be_called_with_a_typed_body(tiny: System) -> None:
    once = tiny.ask("service", "call", "last_number")["value"]
    assert tiny.ask("service", "call", "last_number", '{"factor": 0.0}')["value"] != once
    wrong = regraft(tiny.home, "service", "call", "last_number", "{factr: 1}")
    assert wrong.returncode == 2
    assert "'factr'" in wrong.stderr


def test_a_goal_is_pursued_with_feedback_until_its_result(tiny: System) -> None:
    done = regraft(tiny.home, "goal", "send", "wait_for", "{value: 3}", "--feedback", "--json")
    result = json.loads(done.stdout.splitlines()[-1])
    assert done.returncode == 0
    assert result["value"] >= 3


def test_a_goal_that_takes_too_long_is_cancelled_and_exits_with_1(tiny: System) -> None:
    found = regraft(tiny.home, "action", "send", "wait_for", "{value: 1.0e300}", "--timeout", "0.3")
    assert found.returncode == 1
    assert "cancelled" in found.stderr


def test_a_goal_ends_with_the_command_that_sent_it_however_that_ends(tiny: System, tmp_path: Path) -> None:
    words = ("action", "send", "wait_for", "{value: 1.0e300}", "--feedback")
    sender = Command(*words, log=tmp_path / "log", environment=in_home(tiny.home))
    sender.wait_line("")
    sender.kill()
    wait_until(
        lambda: "its client is gone" in regraft(tiny.home, "logs", "listener").stdout, "the goal to be cancelled"
    )


def test_a_goal_ends_when_nobody_reads_its_feedback_any_more(tiny: System) -> None:
    before = regraft(tiny.home, "logs", "listener").stdout.count("its client is gone")
    command = [*REGRAFT, "goal", "send", "wait_for", "{value: 1.0e300}", "--feedback", "--json"]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, env=in_home(tiny.home), stdout=pipe, stderr=pipe, text=True) as sender:
        assert sender.stdout
        assert "value" in json.loads(sender.stdout.readline())
        sender.stdout.close()
        try:
            told = sender.communicate(timeout=2 * PATIENCE)[1]
        finally:
            sender.kill()
    assert (sender.returncode, told) == (1, "")
    wait_until(
        lambda: regraft(tiny.home, "logs", "listener").stdout.count("its client is gone") > before,
        "the goal to be cancelled",
    )


def test_a_goal_that_is_detached_goes_on(tiny: System) -> None:
    before = regraft(tiny.home, "logs", "listener").stdout.count("its client is gone")
    done = regraft(tiny.home, "action", "send", "wait_for", "{value: 1.0e300}", "--detach")
    assert (done.returncode, done.stderr) == (0, "regraft: wait_for has accepted the goal\n")
    accepted = tiny.ask("action", "send", "wait_for", "{value: 1.0e300}", "--detach")
    assert accepted == {"action": "wait_for", "accepted": True}
    replaced = regraft(tiny.home, "action", "send", "wait_for", "{value: 1.0}")
    assert replaced.returncode == 0
    assert regraft(tiny.home, "logs", "listener").stdout.count("its client is gone") == before


def test_unknown_names_exit_with_2_and_say_what_there_is(tiny: System) -> None:
    for command in (
        ("param", "get", "talkr", "step"),
        ("param", "get", "talker", "stp"),
        ("param", "set", "talkr", "step", "1"),
        ("topic", "info", "numbr"),
        ("service", "call", "last_numbr"),
        ("connect", "listener", "nmber", "spare"),
        ("disconnect", "listener", "nmber"),
        ("journal", "show", "12345"),
        ("logs", "talkr"),
    ):
        found = regraft(tiny.home, *command)
        assert found.returncode == 2, found
        assert "Traceback" not in found.stderr


def test_a_port_is_disconnected_and_the_journal_can_undo_it(tiny: System) -> None:
    tried = tiny.ask("disconnect", "listener", "hint", "--dry-run")
    assert [step["action"] for step in tried["steps"]] == ["disconnect hint (from spare)"]
    done = tiny.ask("disconnect", "listener", "hint", "--reason", "no hints")
    assert done["request"]["changes"] == [{"change": "connect", "component": "listener", "port": "hint", "topic": None}]
    assert tiny.ask("topic", "info", "spare")["readers"] == []
    shown = regraft(tiny.home, "journal", "show", done["id"])
    assert "connect: component listener, port hint, topic null" in shown.stdout
    refused = regraft(tiny.home, "disconnect", "listener", "number")
    assert refused.returncode == 1
    assert "listener.connect.number: input 'number' is required while the component is active" in refused.stderr
    swapped = tiny.ask("swap", "listener", "--connect", "hint=spare")
    assert tiny.ask("topic", "info", "spare")["readers"] == ["listener.hint"]
    tiny.ask("undo", swapped["id"])
    assert tiny.ask("topic", "info", "spare")["readers"] == []
    tiny.ask("undo", done["id"])
    assert tiny.ask("topic", "info", "spare")["readers"] == ["listener.hint"]


def test_a_system_without_a_mission_says_so(tiny: System) -> None:
    found = regraft(tiny.home, "mission", "status")
    assert found.returncode == 3
    assert "no mission executor" in found.stderr


def test_logs_show_what_a_component_wrote(tiny: System) -> None:
    assert any("talker" in line for line in tiny.ask("logs", "talker")["lines"])


def test_a_log_is_followed_as_json_too(tiny: System, tmp_path: Path) -> None:
    following = Command("logs", "listener", "-f", "--json", log=tmp_path / "log", environment=in_home(tiny.home))
    try:
        following.wait_line("{")
        tiny.ask("lifecycle", "set", "listener", "deactivate")
        wait_until(lambda: any("inactive" in line for line in following.lines[1:]), "further lines of the log")
        shown = [json.loads(line) for line in following.lines]
    finally:
        following.kill()
        tiny.ask("lifecycle", "set", "listener", "activate")
    assert {document["component"] for document in shown} == {"listener"}
    assert any("inactive" in line for document in shown[1:] for line in document["lines"])


def test_a_killed_component_is_restarted_with_its_parameters(tiny: System) -> None:
    tiny.ask("param", "set", "talker", "rate=30")
    before = tiny.components()["talker"]
    kill(before["pid"])
    after = tiny.component_after("talker", before["incarnation"])
    assert after["pid"] != before["pid"]
    assert after["restarts"] >= 1
    assert tiny.ask("param", "get", "talker", "rate")["value"] == 30


def test_a_component_can_join_be_changed_directly_and_ends_with_the_system(tmp_path: Path) -> None:
    with System(tmp_path) as system:
        joined = system.join("tiny_parts:Listener", "--name", "ear")
        assert system.component_after("ear", 0)["host"] is None
        system.ask("param", "set", "ear", "offset", "5")
        system.ask("connect", "ear", "number", "spare")
        assert system.ask("topic", "info", "spare")["readers"] == ["ear.number", "ear.hint", "listener.hint"]
        system.ask("disconnect", "ear", "hint")
        assert system.ask("topic", "info", "spare")["readers"] == ["ear.number", "listener.hint"]
        system.ask("lifecycle", "set", "ear", "deactivate")
        assert system.ask("lifecycle", "get", "ear")["state"] == "inactive"
    assert joined.process.returncode == 0


def test_down_ends_the_system_and_leaves_no_process(tmp_path: Path) -> None:
    with System(tmp_path) as system:
        pids = [component["pid"] for component in system.components().values()]
        done = regraft(tmp_path, "down")
        assert done.returncode == 0
        assert system.ended() == 0
    wait_gone(pids)
    assert regraft(tmp_path, "ps", "--json").stdout.split() == ["{", '"systems":', "[]", "}"]


def test_commands_that_look_on_end_with_3_once_the_system_has_ended(tmp_path: Path) -> None:
    with System(tmp_path / "home") as system, ExitStack() as ending:

        def begin(*words: str) -> Command:
            command = Command(*words, log=tmp_path / words[0], environment=in_home(system.home))
            ending.callback(command.kill)
            return command

        echo, events = begin("topic", "echo", "spare"), begin("events", "--kind", "adaptation")
        echo.wait_line("regraft: spare has no writer now")
        wait_until(lambda: system.ask("param", "set", "talker", "step=3") and events.lines, "an event to be shown")
        assert regraft(system.home, "down").returncode == 0
        for command in (echo, events):
            assert command.ended() == 3, command.lines
            assert command.lines[-1] == "regraft: tiny has ended"


def test_a_host_that_joins_prints_json_to_its_end(tmp_path: Path) -> None:
    with System(tmp_path / "home") as system:
        words = ("host", "--join", system.ask("host")["endpoint"], "--name", "edge", "--json")
        edge = Command(*words, log=tmp_path / "edge.log", cwd=STACK, environment=in_home(system.home))
        system.joined.append(edge)
        edge.wait_line("{")
        assert regraft(system.home, "down").returncode == 0
        assert edge.ended() == 0
    first, last = map(json.loads, edge.lines)
    assert first == {"system": "tiny", "host": "edge", "components": []}
    assert last.pop("why") != ""
    assert last == {"system": "tiny", "host": "edge", "ended": True}


def test_ctrl_c_ends_a_healthy_run_with_0(tmp_path: Path) -> None:
    with System(tmp_path) as system:
        system.interrupt()
        assert system.ended() == 0
    assert "ending ..." in system.lines
    assert system.lines[-1].startswith("tiny: ran ")


def test_a_run_of_limited_duration_ends_by_itself_with_one_json_object(tmp_path: Path) -> None:
    done = regraft(tmp_path, "up", str(STACK), "--for", "0.3", "--json", "--system", "brief")
    assert done.returncode == 0
    closing = json.loads(done.stdout)
    assert closing["system"] == "brief"
    assert closing["wall_s"] >= 0.3
    assert closing["problems"] == []


def test_a_run_with_a_quarantined_component_exits_with_1(tmp_path: Path) -> None:
    text = (STACK / "stack.yaml").read_text()
    text += "  broken: {command: [sh, -c, exit 3], managed: false, restart: {limit: 1, backoff: 0.01}}\n"
    (tmp_path / "stack.yaml").write_text(text)
    (tmp_path / "tiny_parts.py").write_text((STACK / "tiny_parts.py").read_text())
    system = System(tmp_path / "home", command=("up", str(tmp_path), "--json"))

    def is_quarantined() -> bool:
        components = [component for found in system.ask("ps")["systems"] for component in found["components"]]
        return any((each["name"], each["process"]) == ("broken", "quarantined") for each in components)

    with ExitStack() as ending:
        ending.push(system)  # it prints no line to wait for
        wait_until(is_quarantined, "the host to give up")
        system.interrupt()
        assert system.ended() == 1
    printed = system.log.read_text()
    closing, _ = json.JSONDecoder().raw_decode(printed, printed.index("{"))
    assert "broken is quarantined" in closing["problems"]


def test_a_component_runs_alone_and_takes_changes_from_anybody(tmp_path: Path) -> None:
    with System(tmp_path, command=("run", "tiny_parts:Talker", "--set", "step=3"), ready="talker runs") as alone:
        assert alone.component_after("talker", 0)["state"] == "active"
        assert alone.ask("param", "get", "talker", "step")["value"] == 3
        alone.ask("param", "set", "talker", "step=4", "rate=50")
        assert alone.ask("param", "get", "talker", "rate")["value"] == 50
        assert regraft(tmp_path, "param", "set", "talker", "step=99").returncode == 2
        tried = regraft(tmp_path, "param", "set", "talker", "step=9", "--dry-run")
        assert tried.returncode == 2
        assert "only an adaptation manager" in tried.stderr
        assert alone.ask("param", "get", "talker", "step")["value"] == 4
        assert alone.ask("topic", "echo", "number", "--once")["type"].startswith("clitest/Number")
        assert regraft(tmp_path, "journal").returncode == 3
        alone.interrupt()
        assert alone.ended() == 0
    assert regraft(tmp_path, "ps").stdout.startswith("no system is running")
