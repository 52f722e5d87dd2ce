"""Commands that are interrupted: at whatever point of their start that comes, they end with a code and no traceback."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tests.cli.live import Done, regraft
from tests.support.commands import in_home, run

# Python drops the exception that a signal raises here.
DROPPED = """
import os, signal
from regraft import Component

class Interrupts:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)

def interrupt():
    Interrupts()

class Part(Component):
    @classmethod
    def preload(cls):
        {prepared}

    def __init__(self):
        {built}

    def on_configure(self):
        {started}

{imported}
"""


def run_alone(folder: Path, **interrupted: str) -> Done:
    """Run the component, interrupted at some points of its start, until it ends."""
    nowhere = {"imported": "pass", "prepared": "pass", "built": "pass", "started": "pass"}
    (folder / "dropped.py").write_text(DROPPED.format(**nowhere | interrupted))
    done = run("run", "dropped:Part", cwd=folder, environment=in_home(folder / "home"), fresh=True)
    return Done(done.returncode, done.stdout, done.stderr)


@pytest.mark.parametrize(
    ("point", "code"),
    [("imported", 130), ("prepared", 130), ("built", 0), ("started", 0)],
    ids=lambda value: str(value),
)
def test_an_interrupt_is_heard_also_where_python_drops_its_exception(point: str, code: int, tmp_path: Path) -> None:
    done = run_alone(tmp_path, **{point: "interrupt()"})
    assert done.returncode == code, done
    assert ("runs alone" in done.stdout) == (code == 0)
    assert regraft(tmp_path / "home", "ps").stdout.startswith("no system is running")


# An interrupt comes as the module is looked for.
WHILE_IMPORTING = """
import os, runpy, signal, sys

class Interrupts:
    def find_spec(self, name, path=None, target=None):
        if name == {module!r}:
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Interrupts())
sys.argv = ["regraft", {command!r}]
runpy.run_module("regraft.cli", run_name="__main__")
"""


@pytest.mark.parametrize(
    ("module", "command"),
    [("regraft.cli.main", "ps"), ("zenoh", "ps"), ("regraft.evaluation.command_line", "evaluate")],
)
def test_an_interrupt_while_a_command_is_imported_shows_no_traceback(module: str, command: str, tmp_path: Path) -> None:
    program = (sys.executable, "-c", WHILE_IMPORTING.format(module=module, command=command))
    done = run(cwd=tmp_path, environment=in_home(tmp_path / "home"), program=program)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")
