"""A tree is tried without a robot: what acts is mocked, and what was reached is reported."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from behavior_tree import StatefulAction, Status
from tests.authors.commands import mission, refused
from tests.executor.helpers import FROG

FETCH = """<root BTCPP_format="4"><BehaviorTree ID="Fetch"><Fallback>
<Sequence><NavigateTo name="there" x="1" y="2"/>
<Sleep msec="1500"/><Grasp what="cup"/></Sequence>
<Say name="sorry" text="I could not"/></Fallback></BehaviorTree></root>"""


class Weld(StatefulAction):
    """A node of somebody else's that would act."""

    def __init__(self, setup: Any, context: object) -> None:
        super().__init__(setup)
        self._context = context

    def on_start(self) -> Status:
        """Must never run here."""
        raise AssertionError("a dry run must not weld")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Return a mission that drives, grasps and else apologizes."""
    (tmp_path / "fetch.xml").write_text(FETCH)
    return tmp_path / "fetch.xml"


def rules(folder: Path, configs: dict[str, Any], substitutions: dict[str, str]) -> Path:
    """Write a file with rules."""
    path = folder / "rules.json"
    path.write_text(json.dumps({"TestNodeConfigs": configs, "SubstitutionRules": substitutions}))
    return path


def tried(*arguments: object, code: int = 0) -> dict[str, Any]:
    """Return what a dry run reports as JSON."""
    done = mission("dry-run", *arguments, "--json")
    assert done.exit_code == code, done
    report: dict[str, Any] = json.loads(done.stdout)
    return report


def test_what_acts_is_mocked_and_what_was_reached_is_counted(file: Path) -> None:
    report = tried(file)
    assert (report["tree"], report["result"], report["error"]) == ("Fetch", "SUCCESS", "")
    assert (report["reached"], report["coverage"]) == (5, 0.8333)
    nodes = {node["name"]: node for node in report["nodes"]}
    assert {name for name, node in nodes.items() if node["mocked"]} == {"there", "Grasp", "sorry"}
    assert nodes["Sleep"]["running"] > 0
    assert (nodes["Grasp"]["successes"], nodes["sorry"]["ticks"]) == (1, 0)
    assert [node["depth"] for node in report["nodes"]] == [0, 1, 2, 2, 2, 1]


def test_time_is_the_trees_own(file: Path) -> None:
    assert tried(file)["seconds"] == 1.5


def test_rules_replace_nodes_by_name_type_and_path(file: Path, tmp_path: Path) -> None:
    mocks = rules(
        tmp_path,
        {"late": {"return_status": "SUCCESS", "async_delay": 500}, "slips": {"return_status_script": "FAILURE"}},
        {"there": "late", "Grasp": "slips", "*Sleep*": "AlwaysSuccess"},
    )
    report = tried(file, "--mocks", mocks)
    assert (report["result"], report["seconds"], report["coverage"]) == ("SUCCESS", 0.5, 1.0)
    assert report["unused_rules"] == []


def test_a_rule_that_replaces_nothing_is_reported(file: Path, tmp_path: Path) -> None:
    mocks = rules(tmp_path, {}, {"Grsp": "AlwaysFailure"})
    assert tried(file, "--mocks", mocks)["unused_rules"] == ["Grsp"]
    assert (
        "warning: the rule 'Grsp' puts nothing in any node's place" in mission("dry-run", file, "--mocks", mocks).stderr
    )


def test_a_tree_that_fails_exits_with_1_and_states_why(file: Path, tmp_path: Path) -> None:
    mocks = rules(tmp_path, {}, {"Grasp": "AlwaysFailure", "sorry": "AlwaysFailure"})
    assert tried(file, "--mocks", mocks, code=1)["result"] == "FAILURE"
    file.write_text(FETCH.replace("<Sleep", '<Script code="n += 1"/><Sleep'))
    report = tried(file, code=1)
    assert "there is no blackboard entry 'n'" in report["error"]
    assert next(node for node in report["nodes"] if node["name"] == "Script")["ticks"] == 1


def test_entries_are_written_first(file: Path) -> None:
    file.write_text(FETCH.replace("<Sleep", '<Script code="n += 1"/><Sleep'))
    assert tried(file, "--set", "n=4")["result"] == "SUCCESS"
    assert "'rounds' is given twice" not in refused("dry-run", file, "--set", "n")
    assert "--set n: is given twice" in refused("dry-run", file, "--set", "n=1", "--set", "n=2")


def test_a_tree_without_end_is_left_when_its_time_is_over(file: Path) -> None:
    file.write_text(FETCH.replace("<Fallback>", "<KeepRunningUntilFailure><Fallback>").replace(
        "</Fallback>", "</Fallback></KeepRunningUntilFailure>"))  # fmt: skip
    report = tried(file, "--for", "20", code=1)
    assert (report["result"], report["seconds"], report["error"]) == ("RUNNING", 20.0, "")


def test_a_large_tree_without_end_is_left_after_a_number_of_ticks(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from regraft.services.bt_executor.authors import dry_run

    monkeypatch.setattr(dry_run, "MAX_NODE_TICKS", 70)
    file.write_text(FETCH.replace("<Fallback>", "<KeepRunningUntilFailure><Fallback>").replace(
        "</Fallback>", "</Fallback></KeepRunningUntilFailure>"))  # fmt: skip
    assert tried(file, code=1)["error"] == "not done after 10 ticks"


def test_nodes_of_others_that_would_act_are_mocked_too(file: Path) -> None:
    file.write_text(FETCH.replace("<Grasp what", "<Weld _what"))
    report = tried(file, "--nodes", "tests.authors.test_dry_run:Weld")
    assert (report["result"], report["nodes"][4]["type"], report["nodes"][4]["mocked"]) == ("SUCCESS", "Weld", True)


def test_the_text_shows_every_node_and_the_coverage(file: Path) -> None:
    lines = mission("dry-run", file).stdout.splitlines()
    assert lines[0].startswith("Fetch: SUCCESS after ")
    assert lines[1] == "5 of 6 nodes reached (83%)"
    assert lines[-1].split() == ["sorry", "(Say)", "mocked,", "not", "reached"]


def test_frogs_mission_is_tried_without_frog() -> None:
    report = tried(FROG, code=1)
    assert "input 'num_cycles' from entry 'goal_count'" in report["error"]


WRONG: dict[str, tuple[str, str]] = {
    "no JSON": ("{", "substitution rules: Expecting property name"),
    "no object": ("[]", "the outermost value must be an object"),
    "an unknown field of a config": (
        '{"TestNodeConfigs": {"a": {"return_status": "SUCCESS", "delay": 3}}}',
        "'a' has 'delay'",
    ),
    "no result": ('{"TestNodeConfigs": {"a": {}}}', "'a' needs return_status or return_status_script"),
    "a status that there is not": (
        '{"TestNodeConfigs": {"a": {"return_status": "SUCCES"}}}',
        "'SUCCES' is not a status",
    ),
    "a name that there is not": ('{"SubstitutionRules": {"Grasp": "AlwaysFail"}}', "did you mean 'AlwaysFailure'?"),
    "too many rules": (
        json.dumps({"SubstitutionRules": {str(number): "AlwaysFailure" for number in range(1001)}}),
        "1001 rules: must be at most 1000",
    ),
    "nesting without end": ("[" * 100_000, "substitution rules"),
    "too much": ('"' + "x" * 1_000_000 + '"', "must have at most 1000000 bytes"),
    "no text": ("\udcff", "it is not in UTF-8"),
}


@pytest.mark.parametrize("wrong", WRONG)
def test_faulty_rules_are_refused_and_name_the_file(wrong: str, file: Path, tmp_path: Path) -> None:
    text, told = WRONG[wrong]
    mocks = tmp_path / "rules.json"
    mocks.write_bytes(text.encode(errors="surrogateescape"))
    complaint = refused("dry-run", file, "--mocks", mocks)
    assert told in complaint
    assert str(mocks) in complaint


def test_a_missing_file_of_rules_or_a_faulty_tree_is_refused(file: Path, tmp_path: Path) -> None:
    assert "nowhere.json: cannot be read" in refused("dry-run", file, "--mocks", tmp_path / "nowhere.json")
    file.write_text(FETCH.replace('msec="1500"', 'msec="long"'))
    assert f"{file}:3: port 'msec'" in refused("dry-run", file)
