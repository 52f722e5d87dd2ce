"""``regraft skills`` reports with places and codes, ends with 0 or 2, and writes four files."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
import rdflib
import yaml

from regraft.adaptation_manager.planners.metacontrol.skills.diagnostics import Code
from regraft.adaptation_manager.planners.metacontrol.skills.reading import LIBRARY
from tests.cli.conftest import Regraft
from tests.metacontrol.skills.texts import GOOD, PAPER, realization, skill

WRONG = GOOD.replace("[speed: 0.5]", "[sped: 0.5]")
WARNED = skill(realization())


@pytest.fixture
def regraft() -> Regraft:
    """Return the command line."""
    return Regraft()


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Return a file of skills, which tests write."""
    return tmp_path / "f.skills"


def test_check_reports_that_a_file_is_right(regraft: Regraft, file: Path) -> None:
    file.write_text(PAPER)
    done = regraft("skills", "check", str(file))
    assert (done.exit_code, done.stdout) == (0, f"{file}: 1 skill, 1 realization, 1 file: right\n")


def test_check_reports_errors_and_warnings_with_their_places_and_ends_with_2(regraft: Regraft, file: Path) -> None:
    file.write_text(WRONG)
    done = regraft("skills", "check", str(file))
    assert done.exit_code == 2
    assert done.stderr.splitlines() == [
        f"regraft: {file}:2:13: warning: 'go' has no estimate of: speed",
        f"{file}:2:50: error: the skill 'move' does not list the quality 'sped'; did you mean 'speed'?",
    ]


def test_check_shows_warnings_and_ends_with_0(regraft: Regraft, file: Path) -> None:
    file.write_text(WARNED)
    done = regraft("skills", "check", str(file))
    assert done.exit_code == 0
    assert done.stdout.startswith(f"{file}:2:13: warning: ")


@pytest.mark.parametrize("command", ["check", "outline"])
def test_editors_read_diagnostics_as_json(regraft: Regraft, file: Path, command: str) -> None:
    file.write_text(WRONG)
    done = regraft("skills", command, str(file), "--json")
    assert (done.exit_code, done.stderr) == (2, "")
    (_, one) = json.loads(done.stdout)["diagnostics"]
    assert one == {
        "file": str(file),
        "line": 2,
        "column": 50,
        "end_line": 2,
        "end_column": 59,
        "severity": "error",
        "code": Code.QUALITY_NOT_LISTED.value,
        "message": "the skill 'move' does not list the quality 'sped'; did you mean 'speed'?",
    }


@pytest.mark.parametrize("command", ["check", "outline", "count", "generate"])
@pytest.mark.parametrize("content", [None, "Skill", WRONG, "\0"])
def test_a_file_with_errors_ends_every_command_with_2(
    regraft: Regraft, file: Path, command: str, content: str | None
) -> None:
    if content is not None:
        file.write_text(content)
    out = file.parent / "out"
    done = regraft("skills", command, str(file), *(("--out", str(out)) if command == "generate" else ()))
    assert done.exit_code == 2
    assert f"{file}:" in done.stderr
    assert not out.exists()


def test_check_compares_with_a_stack(regraft: Regraft, file: Path) -> None:
    file.write_text(GOOD)
    done = regraft("skills", "check", str(file), "--stack", "frog")
    assert (done.exit_code, "there is no component 'motor'" in done.stderr) == (2, True)
    assert regraft("skills", "check", str(file), "--stack", "nix.yaml").exit_code == 2


def test_generate_writes_four_files_that_their_readers_take(regraft: Regraft, tmp_path: Path) -> None:
    done = regraft("skills", "generate", str(LIBRARY / "navigation.skills"), "--out", str(tmp_path / "out"))
    assert done.exit_code == 0, done.stderr
    assert sorted(each.name for each in (tmp_path / "out").iterdir()) == [
        "individuals.owl",
        "observed_components.yaml",
        "observed_qualities.yaml",
        "system_modes.yaml",
    ]
    for name in ("system_modes.yaml", "observed_components.yaml", "observed_qualities.yaml"):
        assert yaml.safe_load((tmp_path / "out" / name).read_text())
    assert len(rdflib.Graph().parse(tmp_path / "out" / "individuals.owl", format="xml")) > 60


def test_generate_takes_one_system_and_namespaces(regraft: Regraft, file: Path, tmp_path: Path) -> None:
    file.write_text(PAPER)
    spaces = ("--domain", "http://me.org/robot#", "--mros", "http://me.org/mros#", "--tomasys", "http://me.org/t/")
    done = regraft("skills", "generate", str(file), "--out", str(tmp_path), "--one-system", "robot", *spaces)
    assert done.exit_code == 0, done.stderr
    assert "\nrobot:\n" in (tmp_path / "system_modes.yaml").read_text()
    assert "metacontrol.org" not in (tmp_path / "individuals.owl").read_text()


def test_one_system_warns_of_realizations_that_it_cannot_provide(regraft: Regraft, file: Path, tmp_path: Path) -> None:
    file.write_text(
        'import "navigation_definitions.skills"\n'
        "Realization drive of to_navigate { Component motor active Quality [safety: 0.5]; context: Default };\n"
        "Realization dock of to_recharge {\n"
        "  Component arm active Quality [safety: 0.5]; requires to_navigate [safety >= 0.5]; context: Default\n};\n"
    )
    done = regraft("skills", "generate", str(file), "--out", str(tmp_path / "out"), "--one-system", "robot")
    assert done.exit_code == 0, done.stderr
    assert f"{file}:3:13: warning: 'dock' requires another skill" in done.stderr


@pytest.mark.parametrize(
    ("option", "value", "problem"),
    [
        ("--one-system", "a.b", "must be letters"),
        ("--one-system", "motor", "is the name of a component"),
        ("--domain", "robot", "must be an absolute IRI"),
        ("--domain", "http://a b#", "must be an absolute IRI"),
        ("--mros", "http://ros/mros", "that ends in '#' or '/'"),
        ("--domain", "http://ros/mros#", "must differ"),
        ("--out", "/dev/null/x", "nothing was changed"),
        ("--out", "/proc/x", "nothing was changed"),
    ],
)
def test_options_that_cannot_be_are_refused(
    regraft: Regraft, file: Path, tmp_path: Path, option: str, value: str, problem: str
) -> None:
    file.write_text(GOOD)
    out = () if option == "--out" else ("--out", str(tmp_path / "out"))
    done = regraft("skills", "generate", str(file), *out, option, value)
    assert (done.exit_code, problem in done.stderr) == (2, True), done.output
    assert not (tmp_path / "out").exists()


def test_a_file_in_the_place_of_the_folder_stays(regraft: Regraft, file: Path) -> None:
    file.write_text(GOOD)
    done = regraft("skills", "generate", str(file), "--out", str(file))
    assert (done.exit_code, file.read_text()) == (2, GOOD)


def test_outline_shows_the_tree(regraft: Regraft, file: Path) -> None:
    file.write_text(f"Quality speed {{ better: lower }}\n{GOOD}")
    assert regraft("skills", "outline", str(file)).stdout.splitlines() == [
        "quality speed (lower is better)",
        "skill move (speed)",
        "  realization go (Default, speed 0.5)",
        "    component motor",
        "      configuration active",
    ]
    _, found = json.loads(regraft("skills", "outline", str(file), "--json").stdout)["outline"]
    assert (found["kind"], found["line"], found["column"]) == ("skill", 2, 7)
    assert found["children"][0]["children"][0]["children"][0]["name"] == "active"


def test_count_shows_the_papers_fifteen(regraft: Regraft, file: Path) -> None:
    file.write_text(PAPER)
    shown = regraft("skills", "count", str(file)).stdout.splitlines()
    assert shown[1].split() == ["to_navigate", "f_slow_mode", "8", "3", "4", "15", "19"]
    (one,) = json.loads(regraft("skills", "count", str(file), "--json").stdout)["realizations"]
    assert (one["object"], one["data"], one["class"], one["assertions"]) == (8, 3, 4, 15)


def test_no_other_command_imports_what_skills_need() -> None:
    code = (
        "import sys; from regraft.cli.main import build; from regraft.cli.extensions import add_extensions\n"
        "needed = ('textx', 'arpeggio', 'rdflib', 'pygls')\n"
        "add_extensions(build()); print([name for name in needed if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_without_the_extra_the_server_names_what_to_install() -> None:
    code = (
        "import sys; sys.modules['pygls'] = None\n"
        "sys.argv = ['regraft', 'skills', 'server']\n"
        "from regraft.cli.entry import main; main()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == "regraft: editors need pygls, which is not installed: pip install 'regraft[editor]'\n"
