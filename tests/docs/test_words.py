"""One word has one meaning: retired words are in no code and on no page, and the public face is documented."""

from __future__ import annotations

import io
import re
import tokenize
from functools import cache

import pytest

import regraft
from tests.support.paths import ROOT

GLOSSARY = ROOT / "docs" / "glossary.md"
FORMER = "regraft/bus_schema/encoding/records.py"
"""It knows former names of fields, for the errors that name the present ones."""
PACKAGES = ("behavior_tree", "regraft")


def retired() -> list[str]:
    """Return the words of the glossary's last table."""
    rows = GLOSSARY.read_text(encoding="utf-8").partition("## Retired words")[2]
    cells = re.findall(r"^\| (`[^|]+) \|", rows, re.MULTILINE)
    return [word for cell in cells for word in re.findall(r"`(\w+)`", cell)]


@cache
def names_in_code() -> dict[str, str]:
    """Return every name that product code uses, with one file that does."""
    found: dict[str, str] = {}
    for path in (path for package in PACKAGES for path in (ROOT / package).rglob("*.py")):
        place = path.relative_to(ROOT).as_posix()
        if place != FORMER:
            tokens = tokenize.generate_tokens(io.StringIO(path.read_text(encoding="utf-8")).readline)
            found |= {token.string: place for token in tokens if token.type == tokenize.NAME}
            found[path.stem] = place
    return found


@pytest.mark.parametrize("word", retired())
def test_a_retired_word_is_in_no_code_and_on_no_page(word: str) -> None:
    assert word not in names_in_code(), names_in_code()[word]
    pages = [ROOT / "README.md", *(ROOT / "docs").glob("*.md")]
    quoted = re.compile(rf"`[^`\n]*\b{word}\b[^`\n]*`")
    assert [page.name for page in pages if page != GLOSSARY and quoted.search(page.read_text(encoding="utf-8"))] == []


@pytest.mark.parametrize("name", regraft.__all__)
def test_every_name_of_the_public_face_is_documented(name: str) -> None:
    table = (ROOT / "docs" / "components.md").read_text(encoding="utf-8").partition("## Importing from regraft")[2]
    assert f"`{name}`" in table.partition("\n## ")[0]
    assert hasattr(regraft, name)
