"""Where a joined host looks for the files of its components."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.bus_schema.messages.protocol.joining import JoinedSystem
from regraft.bus_schema.model.architecture import Architecture
from regraft.stack.installed import packages
from regraft.system.join import stack_folder_of

OUT_OF_REACH = Path("/", "x" * 300)
"""Looking for it is an error: so is looking into another user's home."""


def first_host(stack_folder: Path, packages: dict[str, str] | None = None) -> JoinedSystem:
    return JoinedSystem(
        "run",
        1,
        1,
        Architecture("tests", 1, False, {}, {}),
        0,
        "",
        "/run",
        str(stack_folder),
        3.0,
        packages=packages or {},
    )


def test_the_first_hosts_folder_is_that_of_a_host_that_has_it(tmp_path: Path) -> None:
    assert stack_folder_of(first_host(tmp_path)) == tmp_path


@pytest.mark.parametrize("folder", [OUT_OF_REACH, Path("/no/such/folder")], ids=["unreadable", "absent"])
def test_a_folder_that_is_not_to_be_had_here_gives_way_to_the_current_one(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert stack_folder_of(first_host(folder)) == tmp_path


def test_an_installed_stack_is_found_here_though_the_first_hosts_folder_cannot_be_read() -> None:
    name, here = next(iter(packages().items()))
    assert stack_folder_of(first_host(OUT_OF_REACH, {name: str(OUT_OF_REACH)})) == Path(here)
