"""A run finds what its stack names outside of the stack's folder, and its fingerprint covers that."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from regraft.evaluation.campaign import Campaign, Wanted
from regraft.evaluation.runs import fingerprint
from regraft.evaluation.runs.run_directory import Plan, prepare
from regraft.evaluation.study import Changes, Configuration
from regraft.stack import load
from tests.evaluation.app import command_line
from tests.evaluation.tiny import STUDY as TINY

BASE = """\
clock: simulated
topics: {odometry: regraft/Odometry}
components:
  chimes: {class: "tests.stack.parts:Signals", services: {honk: chimes}, parameters: {horn: chimes.wav}}
"""
ROBOT = """\
include: [../common.yaml]
model: rover.xml
devices: {lidar: {class: "tests.stack.parts:Device", parameters: {beams: $beams}}}
"""
STACK = """\
system: patrol
include: [../../base.yaml, more/inside.yaml]
world: ../../room.xml
robot: ../../rover
components:
  world: {class: "tests.stack.parts:Fleet", parameters: {file: $world, robots: $robots}}
  horns: {class: "tests.stack.parts:Signals", services: {honk: horns}, parameters: {horn: ../../horn.wav}}
"""
INSIDE = """\
components:
  bells: {class: "tests.stack.parts:Signals", services: {honk: bells}, parameters: {horn: ../../../horn.wav}}
  birds: {class: "tests.stack.parts:Signals", services: {honk: birds}, parameters: {horn: ../song.wav}}
  notes: {command: [notes, .., ../../nothing], managed: false}
  tune: {command: [python3, ../../tune.py, ../../horn.wav, own.py, song.wav], managed: false}
"""
FILES = {
    "base.yaml": BASE,
    "chimes.wav": "a sound",
    "room.xml": "<mujoco/>",
    "horn.wav": "another sound",
    "common.yaml": "parameters: {beams: 3}\n",
    "rover/robot.yaml": ROBOT,
    "rover/rover.xml": "<mujoco/>",
    "stacks/patrol/stack.yaml": STACK,
    "stacks/patrol/song.wav": "a song",
    "stacks/patrol/own.py": "print('a tune of its own')",
    "tune.py": "print('a tune')",
    "stacks/patrol/more/inside.yaml": INSIDE,
}


def project(folder: Path) -> Path:
    """Write a stack that shares files with others; return its file."""
    for name, text in FILES.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder / "stacks" / "patrol" / "stack.yaml"


def plan(stack: Path, changes: Changes) -> Plan:
    return Plan("patrols", "plain", Configuration("one", "the only one"), 1, 1, 4.0, stack, (changes,))


def test_a_stack_that_names_files_outside_of_its_folder_is_run_as_it_is(tmp_path: Path) -> None:
    stack = project(tmp_path)
    (tmp_path / "stacks" / "other.wav").write_text("a third sound")
    changes = {"components": {"bells": {"parameters": {"horn": "../other.wav"}}}}
    home = tmp_path / "out" / "work" / "run"
    made = load(prepare(plan(stack, changes), home)).architecture.components
    found = load(stack).architecture.components
    for name in ("world", "notes"):
        assert made[name] == found[name]
    own = tmp_path / "stacks" / "patrol" / "own.py"
    words = ("python3", str(tmp_path / "tune.py"), str(tmp_path / "horn.wav"), str(own), "song.wav")
    assert made["tune"].command == words
    horns = {name: Path(spec.parameters["horn"]).resolve() for name, spec in made.items() if "horn" in spec.parameters}
    assert horns == {
        "chimes": tmp_path / "chimes.wav",
        "horns": tmp_path / "horn.wav",
        "bells": tmp_path / "stacks" / "other.wav",
        "birds": home / "stack" / "song.wav",
    }


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("base.yaml", BASE.replace("simulated", "real")),
        ("chimes.wav", "a sound of other chimes"),
        ("room.xml", "<mujoco model='room'/>"),
        ("horn.wav", "a sound of another horn"),
        ("common.yaml", "parameters: {beams: 4}\n"),
        ("rover/robot.yaml", ROBOT.replace("lidar", "sonar")),
        ("rover/rover.xml", "<mujoco model='rover'/>"),
        ("tune.py", "print('another tune')"),
        ("stacks/patrol/own.py", "print('another tune of its own')"),
    ],
)
@pytest.mark.parametrize("clone", ["elsewhere", "there"])
def test_files_outside_of_the_folder_count_wherever_they_are(
    tmp_path: Path, name: str, text: str, clone: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fingerprint, "INSTALLED_IN", tmp_path / clone)
    one, other = (plan(project(tmp_path / folder), {}) for folder in ("here", "there"))
    before = one.fingerprint(lambda packages: "")
    assert other.fingerprint(lambda packages: "") == before
    (tmp_path / "there" / name).write_text(text)
    assert other.fingerprint(lambda packages: "") != before


def test_paths_in_a_linked_file_lead_from_where_it_is(tmp_path: Path) -> None:
    stack = project(tmp_path)
    shared = tmp_path / "shared"
    shared.mkdir()
    (shared / "more.yaml").write_text(BASE.replace("chimes", "gongs").replace("gongs.wav", "gong.wav"))
    (shared / "gong.wav").write_text("a deep sound")
    (stack.parent / "more" / "linked.yaml").symlink_to(shared / "more.yaml")
    (stack.parent / "more" / "linked.yaml").resolve().chmod(0o444)
    stack.write_text(STACK.replace("more/inside.yaml", "more/inside.yaml, more/linked.yaml"))
    made = load(prepare(plan(stack, {}), tmp_path / "out" / "work" / "run")).architecture.components
    assert Path(made["gongs"].parameters["horn"]).resolve() == shared / "gong.wav"
    assert load(stack).architecture.components["gongs"].parameters["horn"] == str(shared / "gong.wav")


def test_hidden_files_that_a_stack_names_are_used_where_they_are_and_count(tmp_path: Path) -> None:
    stack = project(tmp_path)
    hidden = stack.parent / ".shared"
    (hidden / "sounds").mkdir(parents=True)
    (hidden / "bells.yaml").write_text(BASE.replace("chimes", "gongs").replace("gongs.wav", "sounds/gong.wav"))
    (hidden / "sounds" / "gong.wav").write_text("a deep sound")
    (hidden / "horn.wav").write_text("a hidden sound")
    (hidden / "tune").write_text("#!/bin/sh")
    (stack.parent / "more" / "inside.yaml").write_text(
        INSIDE.replace("../song.wav", "../.shared/horn.wav").replace("[python3", "[.shared/tune")
    )
    stack.write_text(STACK.replace("more/inside.yaml", "more/inside.yaml, .shared/bells.yaml"))
    made = load(prepare(plan(stack, {}), tmp_path / "out" / "work" / "run")).architecture.components
    assert Path(made["birds"].parameters["horn"]).resolve() == hidden / "horn.wav"
    assert Path(made["gongs"].parameters["horn"]).resolve() == hidden / "sounds" / "gong.wav"
    assert made["tune"].command[0] == str(hidden / "tune")
    prints = {plan(stack, {}).fingerprint(lambda packages: "").stack}
    changed = {"horn.wav": "another", "sounds/gong.wav": "another", "tune": "#!/bin/bash", "bells.yaml": BASE}
    for number, (name, text) in enumerate(changed.items(), 2):
        (hidden / name).write_text(text)
        prints.add(plan(stack, {}).fingerprint(lambda packages: "").stack)
        assert len(prints) == number, name


STUDY = '''
"""A study in the folder of its stack."""

from pathlib import Path

from regraft.evaluation.study import Configuration, Report, Study

STUDY = Study(
    "own",
    "is it found?",
    Path(__file__).with_name("stack.yaml"),
    {"plain": (Configuration("one", "the only one"),)},
    lambda results: Report(""),
)
'''
OWN_PARTS = """
from tests.evaluation.tiny_parts import Counter


class OwnCounter(Counter):
    "Counts, as a class of the stack's own."
"""
OWN_STACK = """\
include: [../shared/base.yaml]
components:
  counter: {class: "own_parts_of_a_stack:OwnCounter"}
"""


def own(folder: Path) -> Path:
    """Write a stack with modules of its own, and a study of it; return its file."""
    shared, stack = folder / "shared", folder / "stack"
    shared.mkdir()
    stack.mkdir()
    (shared / "base.yaml").write_text("system: own\nclock: simulated\ntopics: {count: regraft/Twist}\n")
    (stack / "own_parts_of_a_stack.py").write_text(OWN_PARTS)
    (stack / "own_study_of_a_stack.py").write_text(STUDY)
    (stack / "stack.yaml").write_text(OWN_STACK)
    return stack / "stack.yaml"


def test_a_study_in_the_current_folder_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.chdir(own(tmp_path).parent)
    for command, told in (
        (["own_study_of_a_stack:STUDY", "--report-only"], "there is no campaign in"),
        (["claims", "own_study_of_a_stack:STUDY"], "own has no claims"),
    ):
        done = CliRunner().invoke(command_line(), ["evaluate", *command])
        assert (done.exit_code, told in done.output) == (2, True), done.output


@pytest.mark.slow
def test_a_stack_with_modules_of_its_own_is_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "path", list(sys.path))
    study = replace(TINY, stack=own(tmp_path))
    wanted = Wanted(study, "plain", tuple(study.configurations["plain"][:1]), 1, 1, study.seconds)
    campaign, said = Campaign(wanted, tmp_path / "out"), list[str]()
    with campaign.opened(resume=False):
        campaign.run(lambda progress: None, said.append)
    assert len(campaign.results().runs) == 1, said
