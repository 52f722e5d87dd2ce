"""Evidence continues where it stopped, on the very same files alone."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.commands import run
from tests.support.paths import ROOT

pytestmark = pytest.mark.slow

CASES = """
from pathlib import Path

import pytest


def test_of_its_first_time():
    with open("calls", "a") as calls:
        calls.write("first ")


def test_of_its_second_time():
    with open("calls", "a") as calls:
        calls.write("second ")
    assert Path("calls").read_text().count("second") > 1


def test_of_another_machine():
    pytest.skip("not here")


@pytest.fixture
def failing_at_its_end():
    yield
    with open("calls", "a") as calls:
        calls.write("end ")
    assert Path("calls").read_text().count("end") > 1


def test_of_its_end(failing_at_its_end):
    pass
"""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """Return a project of four tests, two of which fail at first."""
    (tmp_path / "test_cases.py").write_text(CASES)
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    (tmp_path / ".gitignore").write_text("calls\nbuild/\n__pycache__/\n.pytest_cache/\n")
    subprocess.run(["git", "init", "--quiet"], cwd=tmp_path, check=True)
    return tmp_path


def sitting(project: Path, *options: str) -> subprocess.CompletedProcess[str]:
    """Run the tests of a project, or the rest of them."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    words = ("-p", "tests.continued.plugin", "-p", "no:cacheprovider", *options)
    return run(*words, cwd=project, environment=environment, program=(sys.executable, "-m", "pytest"))


@pytest.mark.parametrize("options", [(), ("-p", "xdist", "-n", "2")], ids=["alone", "workers"])
def test_what_has_passed_is_not_run_again_and_what_had_failed_is_told(project: Path, options: tuple[str, ...]) -> None:
    first = sitting(project, *options)
    assert first.returncode == pytest.ExitCode.TESTS_FAILED
    assert "1 have passed on these files so far: build/evidence/" in first.stdout, first.stdout

    second = sitting(project, *options)
    assert second.returncode == pytest.ExitCode.OK, second.stdout
    assert "3 have passed on these files so far" in second.stdout
    assert "passed at attempt 2: test_cases.py::test_of_its_second_time" in second.stdout
    assert "passed at attempt 2: test_cases.py::test_of_its_end" in second.stdout
    assert sorted((project / "calls").read_text().split()) == ["end", "end", "first", "second", "second"]


def test_with_nothing_left_to_do_all_has_passed(project: Path) -> None:
    for _ in range(2):
        sitting(project, "-k", "time or end")
    last = sitting(project, "-k", "time or end")
    assert last.returncode == pytest.ExitCode.OK, last.stdout
    assert "3 have passed" in last.stdout


def test_another_file_begins_anew(project: Path) -> None:
    for _ in range(2):
        sitting(project)
    (project / "new.py").write_text("")
    assert "3 have passed" in sitting(project).stdout
    assert (project / "calls").read_text().split().count("first") == 2


def test_a_line_that_was_cut_off_counts_for_nothing(project: Path) -> None:
    sitting(project)
    (record,) = (project / "build/evidence").iterdir()
    lines = record.read_text().splitlines()
    record.write_text("\n".join(line.rsplit("\t", 1)[0] for line in lines))
    sitting(project)
    assert (project / "calls").read_text().split().count("first") == 2


@pytest.mark.parametrize("options", [(), ("-p", "xdist", "-n", "1")], ids=["alone", "worker"])
def test_a_test_that_ends_its_process_counts_as_an_attempt(project: Path, options: tuple[str, ...]) -> None:
    body = "import os\nfrom pathlib import Path\n\n\ndef test_of_a_kill():\n    if not Path('calls').exists():\n"
    (project / "test_cases.py").write_text(f"{body}        Path('calls').write_text('once')\n        os._exit(3)\n")
    assert sitting(project, *options).returncode != pytest.ExitCode.OK
    second = sitting(project, *options)
    assert second.returncode == pytest.ExitCode.OK, second.stdout
    assert "passed at attempt 2: test_cases.py::test_of_a_kill" in second.stdout


def test_without_git_it_says_so(project: Path) -> None:
    shutil.rmtree(project / ".git")
    refused = sitting(project)
    assert refused.returncode == pytest.ExitCode.USAGE_ERROR
    assert "git has to list the files" in refused.stderr
    assert not (project / "build").exists()
