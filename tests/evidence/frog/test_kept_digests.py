"""FROG does today what it did when its digests were written down: a change of code that should change nothing does not.

``digests.json`` has them by processor, and by stack, seconds and renderer. Processors round differently. The digests
are those of MuJoCo, NumPy and OpenCV as ``requirements/robot.txt`` has them. A change that is meant to change what FROG
does writes them anew, and says so in the CHANGELOG.
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from regraft.evaluation.runs.fingerprint import versions
from tests.support.frog import run_frog
from tests.support.paths import FROG

pytestmark = [pytest.mark.evidence, pytest.mark.timeout(3600)]

ALL = json.loads(Path(__file__).with_name("digests.json").read_text())
PROCESSOR = versions()["processor"]


@pytest.mark.parametrize("kind", next(iter(ALL.values())))
def test_equal_seeds_give_the_digests_that_were_written_down(tmp_path: Path, kind: str) -> None:
    assert PROCESSOR in ALL, (
        f"digests were written down on {' and '.join(ALL)}: make those of {PROCESSOR} with older code"
    )
    stack, seconds, renderer = kind.split()
    kept = ALL[PROCESSOR][kind]
    found = {}
    for seed in kept:
        options = ("--seed", seed, "--speed", "max")
        run = run_frog(tmp_path, float(seconds), *options, renderer=renderer, stack=FROG / stack)
        found[seed] = run.summary["digest"]
    assert found == kept
