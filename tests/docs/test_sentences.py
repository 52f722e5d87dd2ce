"""Sentences are short, begin with their subject, and use the field's words: on the pages and in product code."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.docs.sentences import Sentence, of_code, of_file, of_text

ROOT = Path(__file__).parents[2]
PAGES = (
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "behavior_tree/README.md")),
    *sorted((ROOT / "docs").rglob("*.md")),
)
CODE = tuple(sorted(path for package in ("behavior_tree", "regraft") for path in (ROOT / package).rglob("*.py")))
MAX_WORDS = 20
HEADLESS = re.compile(r"(Who|What|Whoever)\b")
AVOIDED = re.compile(
    r"""\b(?:
        (?:say|tell)(?:s|ing)? | said | told | whoever | whatever
        | anew | beside | of\ before | by\ all\ signs | is\ none\ of
        | (?:go|goes|going|went|gone)\ on(?!\ (?:the|a|its|it)\b) | (?:let|lets|letting)\ go
        | not\ un(?!do|der|til)\w+ | (?:nobody|nothing)\b[^,.;:]*\bthat\ (?:do|does|is|has|can)\ not
    )\b(?!\?)""",
    re.IGNORECASE | re.VERBOSE,
)


def mistake(sentence: Sentence) -> str:
    """Return what is wrong with a sentence, empty if nothing is."""
    if sentence.words > MAX_WORDS:
        return f"{sentence.words} words, at most {MAX_WORDS}"
    if HEADLESS.match(sentence.text) and not sentence.is_heading:
        return "begins without its subject"
    avoided = AVOIDED.search(sentence.text)
    return f"{avoided[0]!r}: see CONTRIBUTING.md for the words" if avoided else ""


def mistakes(path: Path) -> list[str]:
    """Return the mistakes of a file, each with its place."""
    place = path.relative_to(ROOT)
    found = ((sentence, mistake(sentence)) for sentence in of_file(path))
    return [f"{place}:{sentence.line}: {wrong}: {sentence.text}" for sentence, wrong in found if wrong]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_the_sentences_of_a_page_are_plain(page: Path) -> None:
    assert mistakes(page) == []


def test_the_sentences_of_product_code_are_plain() -> None:
    assert len(CODE) > 200
    assert [wrong for path in CODE for wrong in mistakes(path)] == []


def test_cells_items_and_paragraphs_are_sentences_of_their_own() -> None:
    text = (
        "# Head\n\nOne `a b c` two. Three: four\nfive.\n\n- six\n- seven\n\n| a b | c |\n|---|---|\n\n```\ncode\n```\n"
    )
    found = [(sentence.line, sentence.text, sentence.words) for sentence in of_text(text)]
    assert found == [
        (1, "Head", 1),
        (3, "One `code` two.", 3),
        (3, "Three:", 1),
        (3, "four five.", 2),
        (6, "six", 1),
        (7, "seven", 1),
        (9, "a b", 2),
        (9, "c", 1),
    ]


def test_comments_behind_code_are_sentences_of_their_own() -> None:
    source = '"""Doc.\n\n    code\n\nEnd.\n"""\n\nA = 1  # one thing\nB = 2  # another\n# A longer\n# comment.\n'
    assert [sentence.text for sentence in of_code(source)] == [
        "Doc.",
        "End.",
        "one thing",
        "another",
        "A longer comment.",
    ]


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        ("word " * 21, "21 words"),
        ("Who shuts down is deactivated.", "subject"),
        ("The step begins anew.", "anew"),
        ("The run goes on.", "goes on"),
        ("The component tells its state.", "tells"),
        ("The header says how long to wait.", "says"),
        ("The robot goes on the dock.", ""),
        ("The component publishes its state.", ""),
    ],
)
def test_a_mistake_is_named(text: str, wrong: str) -> None:
    (sentence,) = of_text(text)
    assert wrong in mistake(sentence)
    assert bool(mistake(sentence)) == bool(wrong)
