"""A stack file that is a link to another runs in the folder of that one, as it was checked."""

from __future__ import annotations

from pathlib import Path

from tests.host.conftest import HEAD
from tests.support.systems import System, all_ended, home
from tests.support.waiting import wait_until


def test_a_program_of_a_linked_stack_file_is_found_in_the_files_own_folder(tmp_path: Path) -> None:
    for folder in ("real", "links"):
        (tmp_path / folder).mkdir()
    program = tmp_path / "real" / "program.sh"
    program.write_text("#!/bin/sh\necho it runs in $(pwd)\nexec sleep 1000\n")
    program.chmod(0o755)
    (tmp_path / "real" / "stack.yaml").write_text(HEAD + "  program: {command: [./program.sh], managed: false}\n")
    (tmp_path / "links" / "stack.yaml").symlink_to(tmp_path / "real" / "stack.yaml")
    with home(tmp_path / "home"), all_ended() as started:
        started.append(System(tmp_path / "links" / "stack.yaml"))
        said = f"it runs in {tmp_path / 'real'}"
        wait_until(lambda: said in started[0].client.logs("program"), "the program to run")
