"""Stack files that cannot be: ``regraft up`` says what is wrong and where, exits with 2, and leaves nothing."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

from regraft import run_directory
from tests.cli.app import whole
from tests.hostile.conftest import HEAD, SINK, SOURCE
from tests.support.commands import run

Write = Callable[..., Path]

FEEDS_NOBODY = HEAD.replace(", writers: many", "")

BROKEN = {
    "an unknown class": (SINK + "  x: {class: 'tests.hostile.parts:Nope'}\n", "has no class 'Nope'"),
    "an unknown module": ("  x: {class: 'no.such.module:Nope'}\n", "cannot import 'no.such.module'"),
    "a duplicate name": (SOURCE + SOURCE, "is given twice"),
    "a wrong type": ("  x: {class: 'tests.hostile.parts:Source', parameters: {step: many}}\n", "x.parameters.step"),
    "a value out of bounds": (
        "  x: {class: 'tests.hostile.parts:Source', parameters: {step: 11}}\n",
        "must be at most 10",
    ),
    "an unknown parameter": (
        "  x: {class: 'tests.hostile.parts:Source', parameters: {stpe: 1}}\n",
        "did you mean 'step'?",
    ),
    "an input that nobody feeds": (SINK, "numbers"),
    "two writers": (SOURCE + SOURCE.replace("source:", "other:"), "it may have one writer"),
    "a port of another type": (SOURCE + "  x: {class: 'tests.hostile.parts:Words'}\n", "hostile_tests/Word"),
    "a class that raises": ("  x: {class: 'tests.hostile.components.raising_import:X'}\n", "RuntimeError: not today"),
    "a path for a name": ("  ../../x: {class: 'tests.hostile.parts:Source'}\n", "cannot name a component"),
    "a name of another alphabet": ("  рoбот: {class: 'tests.hostile.parts:Source'}\n", "cannot name a component"),
}


def up(stack: Path, *options: str) -> subprocess.CompletedProcess[str]:
    """Run ``regraft up`` to its end."""
    return run("up", str(stack), "--headless", *options)


def refusal(stack: Path, *options: str) -> str:
    """Return why ``regraft up``, in this process, refuses a stack before anything runs."""
    done = CliRunner().invoke(whole(), ["up", str(stack), "--headless", *options])
    assert done.exit_code == 2, (done.output, done.exception)
    assert not run_directory.running()
    return done.stderr


@pytest.mark.parametrize("what", BROKEN)
def test_a_stack_that_cannot_be_is_refused_before_anything_runs(stack: Write, what: str) -> None:
    components, said = BROKEN[what]
    path = stack(components, HEAD if what != "two writers" else FEEDS_NOBODY)
    assert said in refusal(path)
    _nothing_began()


def test_a_stack_with_a_class_that_cannot_be_prepared_is_refused_and_leaves_nothing(stack: Write) -> None:
    done = up(stack("  x: {class: 'tests.hostile.parts:Unprepared'}\n"))
    assert done.returncode == 2, done.stdout + done.stderr
    assert "cannot be prepared" in done.stderr
    assert "Traceback" not in done.stderr
    assert not run_directory.running()
    _nothing_began()


def _nothing_began() -> None:
    assert not (run_directory.folder("tests") / "run.json").exists()
    assert not list((run_directory.folder("tests") / "logs").glob("x.log"))


@pytest.mark.parametrize(
    ("override", "said"),
    [
        ("source.step=11", "must be at most 10"),
        ("source.step=fast", "source.parameters.step"),
        ("source.nope=1", "there is no such parameter"),
        ("nobody.step=1", "nobody"),
        ("source.step", "="),
        ("../source.step=1", "../source"),
    ],
)
def test_an_override_that_cannot_be_is_refused_before_anything_runs(stack: Write, override: str, said: str) -> None:
    assert said in refusal(stack(SOURCE), "--set", override)


@pytest.mark.parametrize("name", ["../escape", "a/b", "", "*", "a b", "naïve", "x" * 65])
def test_a_system_name_that_is_none_is_refused_and_makes_no_folder(stack: Write, name: str) -> None:
    assert "cannot name a system" in refusal(stack(SOURCE), "--system", name)
    assert not list(run_directory.home().parent.glob("escape*"))


@pytest.mark.parametrize("duration", ["inf", "nan", "-inf", "1e400"])
def test_a_time_to_run_that_never_ends_is_refused_before_anything_runs(stack: Write, duration: str) -> None:
    assert "--for" in refusal(stack(SOURCE + SINK), "--for", duration)
