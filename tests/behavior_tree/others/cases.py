"""The trees of this folder, and what our engine makes of one."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

from behavior_tree import LoadError, ManualClock, TreeError, load_text
from behavior_tree.scripted import LETTERS
from behavior_tree.status import RUNNING
from tests.behavior_tree.golden.typed_leaves import typed_registry

FOLDER = Path(__file__).parent
TICKS = 20


def cases(file: str) -> dict[str, str]:
    """Return the documents of a file by name."""
    found = ElementTree.parse(FOLDER / file).getroot().findall("case")
    return {case.attrib["name"]: ElementTree.tostring(case[0], encoding="unicode").strip() for case in found}


def verdict(xml: str) -> str:
    """Return ``refused``, ``error``, or the letter of the last result of some ticks; unknown nodes succeed."""
    try:
        tree = load_text(xml, typed_registry([]), clock=ManualClock(), mock_unknown=True)
    except LoadError:
        return "refused"
    try:
        for _ in range(TICKS):
            status = tree.tick_once()
            if status != RUNNING:
                break
    except TreeError:
        return "error"
    return LETTERS[status]
