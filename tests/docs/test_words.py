"""One word has one meaning: retired words are in no code and on no page, and the public face is documented."""

from __future__ import annotations

import io
import re
import tokenize

import regraft
from tests.support.paths import ROOT

GLOSSARY = ROOT / "docs" / "glossary.md"
FORMER = "regraft/bus_schema/former_names.py"
"""It knows former names of fields, for the errors that name the present ones."""
PACKAGES = ("behavior_tree", "regraft")


def retired() -> list[str]:
    """Return the words of the glossary's last table."""
    rows = GLOSSARY.read_text(encoding="utf-8").partition("## Retired words")[2]
    cells = re.findall(r"^\| (`[^|]+) \|", rows, re.MULTILINE)
    return [word for cell in cells for word in re.findall(r"`(\w+)`", cell)]


def names_in_code(words: list[str]) -> dict[str, str]:
    """Return every name that product code uses, with one file that does; of files with none of the words, their own."""
    found: dict[str, str] = {}
    any_word = re.compile(rf"\b(?:{'|'.join(words)})\b")
    for path in (path for package in PACKAGES for path in (ROOT / package).rglob("*.py")):
        place = path.relative_to(ROOT).as_posix()
        if place != FORMER:
            text = path.read_text(encoding="utf-8")
            # To take a file apart takes twenty times as long as to look for the words.
            tokens = tokenize.generate_tokens(io.StringIO(text).readline) if any_word.search(text) else ()
            found |= {token.string: place for token in tokens if token.type == tokenize.NAME}
            found[path.stem] = place
    return found


def quoted_on_pages() -> dict[str, str]:
    """Return every word in back quotes on the pages, with one page that has it."""
    found: dict[str, str] = {}
    for page in (ROOT / "README.md", *(ROOT / "docs").glob("*.md")):
        if page != GLOSSARY:
            spans = re.findall(r"`[^`\n]*`", page.read_text(encoding="utf-8"))
            found |= {word: page.name for span in spans for word in re.findall(r"\w+", span)}
    return found


def test_no_retired_word_is_in_code_or_on_a_page() -> None:
    words = retired()
    code, pages = names_in_code(words), quoted_on_pages()
    assert len(words) > 40
    assert {word: code[word] for word in words if word in code} == {}
    assert {word: pages[word] for word in words if word in pages} == {}


def test_every_name_of_the_public_face_is_documented() -> None:
    table = (ROOT / "docs" / "components.md").read_text(encoding="utf-8").partition("## Importing from regraft")[2]
    shown = table.partition("\n## ")[0]
    assert [name for name in regraft.__all__ if f"`{name}`" not in shown or not hasattr(regraft, name)] == []
