"""``regraft skills kb`` saves the knowledge base of skills and OWL files, and answers queries on it, within bounds."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from regraft.adaptation_manager.planners.metacontrol.knowledge.knowledge_base import load
from regraft.adaptation_manager.planners.metacontrol.skills.knowledge import knowledge_of
from regraft.adaptation_manager.planners.metacontrol.skills.reading import LIBRARY, read_skills
from tests.cli.conftest import Regraft
from tests.metacontrol.owl import individual, write
from tests.metacontrol.skills.texts import GOOD

NAVIGATION = LIBRARY / "navigation.skills"
SAFEST = (
    "SELECT ?design ?value { ?design tomasys:hasQAestimation ?q ."
    " ?q tomasys:isQAtype mros:safety ; tomasys:hasValue ?value } ORDER BY DESC(?value) LIMIT 2"
)


@pytest.fixture
def regraft() -> Regraft:
    """Return the command line."""
    return Regraft()


def test_a_base_is_saved_and_is_the_same_when_loaded(regraft: Regraft, tmp_path: Path) -> None:
    out = tmp_path / "base.owl"
    done = regraft("skills", "kb", "save", str(NAVIGATION), "--out", str(out))
    assert (done.exit_code, done.stdout) == (0, f"{out}: 120 facts and 15 rules of 4 files\n")
    assert set(load([out]).facts) == set(knowledge_of(read_skills(NAVIGATION)).facts)


def test_files_of_skills_and_owl_files_are_one_base(regraft: Regraft, tmp_path: Path) -> None:
    skills = tmp_path / "robot.skills"
    skills.write_text(GOOD)
    more = write(tmp_path, individual("other", "tomasys:FunctionDesign", tomasys__solvesF=">nav:move"), imports=())
    query = "SELECT ?design { ?design a tomasys:FunctionDesign } ORDER BY ?design"
    done = regraft("skills", "kb", "query", str(skills), str(more), "--sparql", query)
    assert done.stdout.split() == ["design", "other", "go"]


def test_a_query_is_a_table_for_people_and_json_for_programs(regraft: Regraft) -> None:
    done = regraft("skills", "kb", "query", str(NAVIGATION), "--sparql", SAFEST)
    assert [line.split() for line in done.stdout.splitlines()] == [
        ["design", "value"],
        ["normal", "0.8"],
        ["slow", "0.7"],
    ]
    done = regraft("skills", "kb", "query", str(NAVIGATION), "--sparql", SAFEST, "--json")
    space = "http://ros/navigation_domain#"
    assert json.loads(done.stdout) == {
        "columns": ["design", "value"],
        "rows": [[f"{space}normal", 0.8], [f"{space}slow", 0.7]],
    }


def test_a_query_may_be_in_a_file_and_ask(regraft: Regraft, tmp_path: Path) -> None:
    file = tmp_path / "any.rq"
    file.write_text("ASK { ?design mros:fd_is_rest true }")
    assert regraft("skills", "kb", "query", str(NAVIGATION), "--sparql", str(file)).stdout == "no\n"
    done = regraft("skills", "kb", "query", str(NAVIGATION), "--sparql", "ASK { ?a ?b ?c }", "--json")
    assert json.loads(done.stdout) == {"answer": True}


@pytest.mark.parametrize(
    ("sparql", "problem"),
    [
        ("ASK {", "--sparql: line 1, column"),
        ("SELEC ?a { ?a ?b ?c }", "this is no SELECT or ASK query"),
        ("nowhere.rq", "--sparql nowhere.rq: is neither a SPARQL query nor a file"),
        ("/", "--sparql /: is no file"),
        ("SELECT * { SERVICE <http://a.org/> { ?a ?b ?c } }", "SERVICE asks another machine"),
        ("ASK { ?a ?b " + "(" * 30, "brackets inside each other"),
        ("ASK {" + " " * 20_000, "must have at most 16384"),
        ("DELETE WHERE { ?a ?b ?c }", "this is no SELECT or ASK query"),
    ],
)
def test_queries_that_cannot_be_answered_end_with_2(regraft: Regraft, sparql: str, problem: str) -> None:
    done = regraft("skills", "kb", "query", str(NAVIGATION), "--sparql", sparql)
    assert (done.exit_code, done.stdout, problem in done.stderr) == (2, "", True), done.stderr


def test_a_query_of_a_file_that_is_none_ends_with_2(regraft: Regraft, tmp_path: Path) -> None:
    file = tmp_path / "binary.rq"
    for content, problem in ((b"\xff", "is not UTF-8 text"), (b"#" * 70_000, "has more than 65536 bytes")):
        file.write_bytes(content)
        done = regraft("skills", "kb", "query", str(NAVIGATION), "--sparql", str(file))
        assert (done.exit_code, problem in done.stderr) == (2, True), done.stderr


@pytest.mark.parametrize("command", [("save", "--out", "saved.owl"), ("query", "--sparql", "ASK { ?a ?b ?c }")])
@pytest.mark.parametrize(
    ("name", "content", "problem"),
    [
        ("a.skills", None, "there is no such file"),
        ("a.owl", None, "cannot be read: No such file"),
        ("a.txt", "", "must be a file of skills or an OWL file"),
        ("a.skills", "Skill", "a.skills:1:6: error: expected a name"),
        ("a.owl", "<a/>", "a.owl:1: the first element is 'a'"),
    ],
)
def test_files_that_are_none_end_with_2_and_write_nothing(
    regraft: Regraft,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    command: tuple[str, ...],
    name: str,
    content: str | None,
    problem: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    if content is not None:
        Path(name).write_text(content)
    done = regraft("skills", "kb", command[0], name, *command[1:])
    assert (done.exit_code, problem in done.stderr) == (2, True), done.stderr
    assert not Path("saved.owl").exists()


def test_files_that_contradict_each_other_are_named(regraft: Regraft, tmp_path: Path) -> None:
    files = []
    for name, weight in (("one", 0.2), ("other", 0.5)):
        files.append(str(tmp_path / f"{name}.skills"))
        Path(files[-1]).write_text(f"Quality speed {{ weight: {weight} }}\n")
    done = regraft("skills", "kb", "query", *files, "--sparql", "ASK { ?a ?b ?c }")
    assert done.exit_code == 2
    assert f"{files[1]}:1: speed: qa_weight has one value at most" in done.stderr
    assert f"(with {files[0]})" in done.stderr


def test_a_place_that_cannot_be_written_ends_with_2(regraft: Regraft) -> None:
    done = regraft("skills", "kb", "save", str(NAVIGATION), "--out", "/proc/saved.owl")
    assert (done.exit_code, "--out /proc/saved.owl: cannot be written" in done.stderr) == (2, True)


def test_more_files_than_a_base_may_have_are_refused(regraft: Regraft, tmp_path: Path) -> None:
    files = [str(tmp_path / f"{number}.owl") for number in range(70)]
    done = regraft("skills", "kb", "save", *files, "--out", str(tmp_path / "out.owl"))
    assert (done.exit_code, "70 files were given, at most 64 are allowed" in done.stderr) == (2, True)
