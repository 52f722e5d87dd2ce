"""A host that joins looks for modules where the first one does: also in the folders of robots and included files."""

from __future__ import annotations

from pathlib import Path

from regraft.bus_schema.messages.protocol.joining import JoinedSystem
from regraft.bus_schema.model.architecture import Architecture
from regraft.host.plan import module_folders
from regraft.stack import load
from regraft.stack.installed import packages
from tests.stack.reading.folders import TWO, rovers


def joined(stack_folder: str, *folders: str) -> JoinedSystem:
    """Return what a host hears of a stack as it joins."""
    architecture = Architecture("tests", 1, False, {}, {})
    installed = {"regraft": "/opt/regraft"}
    return JoinedSystem(
        "run", 1, 1, architecture, 0, "", "/run", stack_folder, 3.0, packages=installed, folders=folders
    )


def test_a_host_of_the_same_machine_finds_modules_of_robots_and_included_files(tmp_path: Path) -> None:
    lab, common = tmp_path / "lab", tmp_path / "common"
    file = rovers(lab, f"include: [../common/base.yaml]\n{TWO}")
    common.mkdir()
    (common / "base.yaml").write_text("seed: 3\n")
    folders = load(file).folders
    assert set(folders) == {lab, common, lab / "rover"}
    assert module_folders(joined(str(lab), *map(str, folders)), lab) == folders


def test_another_machine_has_them_below_its_own_folder_and_in_its_own_packages(tmp_path: Path) -> None:
    first = joined("/lab", "/lab", "/lab/rover", "/opt/regraft/robots/waffle", "/common")
    here = Path(packages()["regraft"])
    assert module_folders(first, tmp_path) == (
        tmp_path,
        tmp_path / "rover",
        here / "robots" / "waffle",
        Path("/common"),
    )
