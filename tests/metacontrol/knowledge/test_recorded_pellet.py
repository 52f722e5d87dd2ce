"""The rule engine concludes what Pellet concluded of eight random bases, comparisons included.

``tests/evidence/test_pellet.py`` compares them with Pellet itself, where there is Java.
"""

from __future__ import annotations

import json
from pathlib import Path

from regraft.adaptation_manager.planners.metacontrol.knowledge.knowledge_base import load
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import Data
from tests.metacontrol.owl import APPLICATION

RECORDED = Path(__file__).with_name("pellet")


def test_the_conclusions_are_those_that_were_recorded_of_pellet() -> None:
    found: set[tuple[object, ...]] = set()
    for fact in load([RECORDED / "bases.owl"]).conclude().all():
        terms = (term.value if isinstance(term, Data) else term.removeprefix(APPLICATION) for term in fact[1:])
        if fact[0].startswith(APPLICATION):
            found.add((fact[0].removeprefix(APPLICATION), *terms))
    recorded = json.loads((RECORDED / "conclusions.json").read_text())
    assert len(recorded) > 100
    assert found == set(map(tuple, recorded))
