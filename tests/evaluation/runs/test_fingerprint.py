"""The fingerprint of a run changes with all that can influence it, and with nothing of where a machine has it."""

from __future__ import annotations

import importlib
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from regraft.evaluation.runs.fingerprint import (
    Fingerprint,
    code_hash,
    files_hash,
    files_in,
    fingerprint_from,
    packages_named,
    stack_hash,
    versions,
)
from regraft.evaluation.runs.folder_lock import LOCK
from regraft.evaluation.runs.run_directory import Plan
from regraft.evaluation.study import Configuration
from tests.evaluation.tiny import STUDY

PACKAGE = "fingerprinted"
BEFORE = Fingerprint("a" * 64, {"numpy": "1", "scipy": "1"}, "b" * 64, "c" * 64, 1, 300.0)


def package_in(folder: Path) -> Path:
    """Make a package of somebody else's."""
    made = folder / PACKAGE
    made.mkdir(parents=True)
    (made / "__init__.py").write_text("")
    (made / "parts.py").write_text("SPEED = 1\n")
    (made / "model.xml").write_text("<mujoco/>")
    return made


def hash_with(monkeypatch: pytest.MonkeyPatch, folder: Path) -> str:
    with monkeypatch.context() as patched:
        patched.syspath_prepend(str(folder))
        importlib.invalidate_caches()
        return code_hash([PACKAGE])


def compiled(package: Path) -> None:
    (package / "__pycache__").mkdir()
    (package / "__pycache__" / "parts.cpython-311.pyc").write_bytes(b"compiled")


def explained(package: Path) -> None:
    (package / "README.md").write_text("for people")


def recoded(package: Path) -> None:
    (package / "parts.py").write_text("SPEED = 2\n")


def remodelled(package: Path) -> None:
    (package / "model.xml").write_text("<mujoco model='other'/>")


def renamed(package: Path) -> None:
    (package / "parts.py").rename(package / "pieces.py")


@pytest.mark.parametrize(
    ("change", "differs"),
    [(compiled, False), (explained, False), (recoded, True), (remodelled, True), (renamed, True)],
)
def test_code_and_its_data_count_wherever_they_are(
    change: Callable[[Path], None], differs: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package_in(tmp_path / "here")
    change(package_in(tmp_path / "there"))
    assert (hash_with(monkeypatch, tmp_path / "here") != hash_with(monkeypatch, tmp_path / "there")) == differs
    assert hash_with(monkeypatch, tmp_path / "here") != code_hash()


def test_packages_of_others_are_those_that_a_stack_names_classes_of() -> None:
    document = {
        "system": "a:b c",
        "components": {
            "camera": {"class": "regraft.sim_service.world:World"},
            "rows": {"class": "mine.parts:Rows", "parameters": {"nodes": ["theirs:NODES"], "at": "tcp/127.0.0.1:80"}},
        },
    }
    assert packages_named(document) == ("mine", "theirs")


def test_a_stack_is_the_same_one_in_another_folder(tmp_path: Path) -> None:
    hashes = set()
    for name in ("one", "other"):
        folder, outside = tmp_path / name / "stack", tmp_path / name / "mesh.stl"
        folder.mkdir(parents=True)
        outside.write_text("a mesh")
        hashes.add(stack_hash({"world": str(folder / "world.xml"), "meshes": [str(outside)]}, folder))
    outside.write_text("another mesh")
    assert len(hashes) == 1
    assert stack_hash({"world": str(folder / "world.xml"), "meshes": [str(outside)]}, folder) not in hashes


def test_files_next_to_a_stack_count_and_campaigns_there_do_not(tmp_path: Path) -> None:
    (tmp_path / "mission.xml").write_text("<root/>")
    before = files_hash(tmp_path)
    (tmp_path / "study-plain" / "runs").mkdir(parents=True)
    (tmp_path / "study-plain" / LOCK).write_text("")
    (tmp_path / "study-plain" / "runs" / "run.json").write_text("{}")
    assert files_hash(tmp_path) == before
    shutil.copy(tmp_path / "mission.xml", tmp_path / "decision.yaml")
    assert files_hash(tmp_path) != before


def test_a_linked_folder_counts_as_one_that_is_there(tmp_path: Path) -> None:
    stack, shared, copied = tmp_path / "stack", tmp_path / "shared", tmp_path / "copied"
    (shared / "deep").mkdir(parents=True)
    (shared / "deep" / "mission.xml").write_text("<root/>")
    for folder in (stack, copied):
        folder.mkdir()
        (folder / "decision.yaml").write_text("choices: {}\n")
    (stack / "missions").symlink_to(shared)
    shutil.copytree(shared, copied / "missions")
    before = files_hash(stack)
    assert before == files_hash(copied)
    (shared / "deep" / "mission.xml").write_text("<other/>")
    assert files_hash(stack) != before


def test_links_in_a_circle_are_followed_once(tmp_path: Path) -> None:
    for name, other in (("one", "other"), ("other", "one")):
        (tmp_path / "stack" / name).mkdir(parents=True)
        (tmp_path / "stack" / name / "mission.xml").write_text(name)
        (tmp_path / "stack" / name / "link").symlink_to(tmp_path / "stack" / other)
    (tmp_path / "stack" / "one" / "up").symlink_to(tmp_path)
    names = [path.relative_to(tmp_path).as_posix() for path in files_in(tmp_path / "stack")]
    assert names == [f"stack/{name}/mission.xml" for name in ("one/link", "one", "other/link", "other")]


def test_campaigns_in_a_linked_folder_do_not_count(tmp_path: Path) -> None:
    (tmp_path / "stack").mkdir()
    (tmp_path / "stack" / "mission.xml").write_text("<root/>")
    before = files_hash(tmp_path / "stack")
    (tmp_path / "results" / "study-plain" / "runs").mkdir(parents=True)
    (tmp_path / "results" / "study-plain" / LOCK).write_text("")
    (tmp_path / "results" / "study-plain" / "runs" / "run.json").write_text("{}")
    (tmp_path / "stack" / "results").symlink_to(tmp_path / "results")
    assert files_hash(tmp_path / "stack") == before


def test_a_folder_without_links_has_the_hash_that_it_always_had(tmp_path: Path) -> None:
    (tmp_path / "b" / "__pycache__").mkdir(parents=True)
    (tmp_path / ".hidden").mkdir()
    for name in ("b/mission.xml", "b.xml", "a", "b/__pycache__/parts.pyc", "README.md", ".hidden/notes"):
        (tmp_path / name).write_text(name)
    (tmp_path / "gone").symlink_to(tmp_path / "nothing")
    (tmp_path / "study-plain").mkdir()
    (tmp_path / "study-plain" / LOCK).write_text("")
    (tmp_path / "study-plain" / "report.txt").write_text("report")
    assert files_hash(tmp_path) == "2a83ef6eecd22854eb971f8678fc581167a26e42feaee86d8262ab71065e7336"


def test_versions_are_those_that_are_installed() -> None:
    found = versions()
    assert found["numpy"] == np.__version__
    assert {"Python", "platform", "renderer", "eclipse-zenoh", "msgpack"} <= found.keys()


def test_versions_are_of_all_that_regraft_requires_but_for_those_who_change_it() -> None:
    found = versions().keys()
    assert {"greenlet", "textX", "rdflib", "fastapi", "uvicorn", "PyYAML", "mujoco-core", "scipy", "ortools"} <= found
    assert not found & {"regraft", "pytest", "ruff", "mypy", "sphinx"}


def test_the_distribution_of_a_class_that_a_stack_names_has_its_version_in_the_fingerprint(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package_in(tmp_path)
    about = tmp_path / "somebodys_parts-1.5.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: somebodys-parts\nVersion: 1.5\n")
    (about / "top_level.txt").write_text(f"{PACKAGE}\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    changes = {"components": {"parts": {"class": f"{PACKAGE}.parts:Parts"}}}
    plan = Plan("tiny", "plain", Configuration("one", "the only one"), 1, 1, 4.0, STUDY.stack, (changes,))
    assert plan.fingerprint().dependencies["somebodys-parts"] == "1.5"
    assert "somebodys-parts" not in replace(plan, changes=()).fingerprint().dependencies


@pytest.mark.parametrize(
    ("after", "named"),
    [
        (replace(BEFORE, code="d" * 64), "other code (hash aaaaaaaaaaaa then, dddddddddddd now)"),
        (replace(BEFORE, dependencies={"numpy": "2"}), "(numpy 1 then, 2 now; scipy 1 then, none now)"),
        (replace(BEFORE, stack="d" * 64), "other stack (hash"),
        (replace(BEFORE, files="d" * 64), "other files (hash"),
        (replace(BEFORE, seed=2), "other seed (1 then, 2 now)"),
        (replace(BEFORE, seconds=60.0), "other seconds (300 then, 60 now)"),
    ],
)
def test_a_difference_names_its_part(after: Fingerprint, named: str) -> None:
    (difference,) = BEFORE.differences(after)
    assert named in difference


def test_a_fingerprint_can_be_stored_and_other_data_are_none() -> None:
    assert fingerprint_from(BEFORE.plain()) == BEFORE
    assert fingerprint_from("b87f") is None
    assert fingerprint_from({"code": "b87f"}) is None
