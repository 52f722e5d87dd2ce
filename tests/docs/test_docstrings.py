"""Examples in docstrings show what really comes."""

from __future__ import annotations

import doctest
import importlib
from pathlib import Path

import pytest

from tests.support.paths import ROOT

MODULES = sorted(
    path.relative_to(ROOT)
    for room in ("behavior_tree", "regraft")
    for path in (ROOT / room).rglob("*.py")
    if ">>> " in path.read_text()
)


@pytest.mark.parametrize("module", MODULES, ids=Path.as_posix)
def test_the_examples_of_a_module_show_what_comes(module: Path) -> None:
    name = ".".join(module.with_suffix("").parts).removesuffix(".__init__")
    result = doctest.testmod(importlib.import_module(name))
    assert result.attempted
    assert not result.failed
