"""Stack files changed at random: each is refused in one clear line, or means something."""

from __future__ import annotations

import random
import shutil
from pathlib import Path

import pytest

from regraft.stack.load import load
from regraft.stack.yaml.problems import StackError
from tests.attack.tally import Tally
from tests.support.paths import ROOT

pytestmark = [pytest.mark.attack, pytest.mark.timeout(600)]

TIMES = 300
LONGEST = 1000
WORDS = (
    "null",
    "[]",
    "{}",
    "-1",
    "1e999",
    "''",
    "&a [*a]",
    "!!python/object:os.system",
    "\t",
    "~",
    "9" * 500,
    "😀",
    "a: b: c",
)


def _changed(text: str, chance: random.Random) -> str:
    lines = text.splitlines()
    for _ in range(chance.randint(1, 3)):
        at = chance.randrange(len(lines))
        line = lines[at]
        lines[at] = chance.choice(
            (
                line[: chance.randint(0, len(line))],
                line.partition(":")[0] + ": " + chance.choice(WORDS),
                " " * chance.randint(0, 5) + line,
                line + chance.choice(WORDS),
                chance.choice(lines),
                "",
            )
        )
    return "\n".join(lines) + "\n"


def test_a_stack_file_changed_at_random_is_refused_in_a_clear_line_or_means_something(
    tmp_path: Path, chance: random.Random, tally: Tally
) -> None:
    shutil.copytree(ROOT / "regraft" / "stacks" / "frog", tmp_path / "frog")
    path = tmp_path / "frog" / "stack.yaml"
    whole = path.read_text()
    for number in range(TIMES):
        path.write_text(_changed(whole, chance))
        with tally.one("stack file changed at random", f"number {number}: {path.read_text()!r}"):
            for problem in _problems(path):
                assert problem.startswith(f"{path.parent}/"), problem
                assert len(problem) < LONGEST, problem
                assert "\n" not in problem, problem


def _problems(path: Path) -> list[str]:
    """Return what is said to be wrong with a stack file, each in a line."""
    try:
        load(path)
    except StackError as error:
        return [str(problem) for problem in error.problems]
    except Exception as error:
        raise AssertionError(f"{type(error).__name__}: {error}") from error
    return []
