"""Modules whose import does what none may, several in one stack: each is refused in a line of its own."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.attack.tally import Tally
from tests.hostile.components.test_imports import CLASS, HOSTILE, command, refused
from tests.hostile.conftest import SINK, SOURCE

pytestmark = [pytest.mark.attack, pytest.mark.timeout(600)]

AT_ONCE = 3


def test_modules_that_do_what_no_import_may_are_each_refused_in_one_line(
    stack: Callable[..., Path], chance: random.Random, tally: Tally
) -> None:
    left = chance.sample(sorted(HOSTILE), len(HOSTILE))
    while left:
        chosen, left = left[:AT_ONCE], left[AT_ONCE:]
        # Names that were not there before: what Python has compiled of another module would be taken for it.
        parts = {f"hostile_{len(left) + number}": HOSTILE[what] for number, what in enumerate(chosen)}
        lines = [f"  {name}: {{class: '{name}:Part'}}\n" for name in parts]
        file = stack("".join(chance.sample([*lines, SOURCE, SINK], len(lines) + 2)))
        for name, (text, _) in parts.items():
            (file.parent / f"{name}.py").write_text(f"{text}\n{CLASS}")
        done = command(file.parent, "up", ".", "--headless")
        for what, (name, (_, said)) in zip(chosen, parts.items(), strict=True):
            with tally.one("module that does what no import may", what):
                refused(done, f"components.{name}.class: '{name}:Part': importing '{name}' {said}")
                assert done.stderr.count("\n") == len(chosen), done.stderr
