"""Journals damaged at random while nobody looks: nothing that was told is taken back."""

from __future__ import annotations

import random

import pytest

from tests.adaptation.system import System
from tests.adaptation.test_damaged_journal import damage_and_return
from tests.attack.tally import Tally

pytestmark = [pytest.mark.attack, pytest.mark.timeout(900)]

DAMAGES = 60


@pytest.mark.parametrize("part", range(5))
def test_wherever_a_journal_is_damaged_what_runs_is_what_the_architecture_says(
    part: int, system: System, chance: random.Random, tally: Tally
) -> None:
    for number in range(DAMAGES):
        with tally.one("journal or its WAL damaged", f"number {number}"):
            damage_and_return(system, chance)
