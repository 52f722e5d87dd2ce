"""Hosts frozen at random instants: two runs of a component never act at once."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from tests.attack.actor import TIMES, Attacked
from tests.attack.tally import Tally
from tests.host.several import Site

pytestmark = [pytest.mark.attack, pytest.mark.timeout(900)]


@pytest.mark.parametrize("part", range(2))
def test_two_runs_never_act_when_a_host_is_frozen(
    part: int, site: Site, tmp_path: Path, chance: random.Random, tally: Tally
) -> None:
    attacked = Attacked(site, tmp_path, chance)
    for number in range(TIMES):
        everything = bool(number % 2)
        with tally.one(f"host frozen, {'with all that it runs' if everything else 'alone'}", f"number {number}"):
            attacked.freeze(everything)
