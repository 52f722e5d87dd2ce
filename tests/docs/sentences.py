"""Sentences of pages and of product code, each with the file and line where it begins."""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from dataclasses import dataclass
from inspect import cleandoc
from pathlib import Path

FENCE = re.compile(r"^```.*?^```$|(?<=\n\n)(?: {4}[^\n]*\n?)+", re.MULTILINE | re.DOTALL)
"""Code in a block: fenced, or indented behind an empty line."""
CODE = re.compile(r"``[^`]*``|`[^`]*`|:\w+:`[^`]*`")
LINK = re.compile(r"!?\[([^]]*)\]\([^)]*\)")
NEW_UNIT = re.compile(r"\s*(?:[-*] |\d+\. |#+ |> |[├└│]|\||\.\. |>>> |Raises:|Attributes:|Args:|Returns:|Yields:)")
"""A line that begins a text of its own: an item, a heading, a row, a branch of a tree, a section of a docstring."""
END = re.compile(r"(?<=[.!?:;])[)\"'*_]*\s+(?!\d+\b)")
TOOLS = re.compile(r"#\s*(?:noqa|type:|pragma|mypy:|ruff:|fmt:|!)")
"""Comments for tools."""


@dataclass(frozen=True, slots=True)
class Sentence:
    """One sentence, with its code spans replaced by one word each."""

    line: int
    text: str
    is_heading: bool = False

    @property
    def words(self) -> int:
        """Count the words; signs alone are none."""
        return sum(any(sign.isalnum() for sign in word) for word in self.text.split())


def of_text(text: str, line: int = 1) -> Iterator[Sentence]:
    """Yield the sentences of a text in Markdown or of a docstring."""
    blank = LINK.sub(lambda link: link[1], CODE.sub(_as_one_word, FENCE.sub(_as_empty_lines, text)))
    for start, paragraph in _paragraphs(blank):
        cells = paragraph.strip("| ").split(" | ") if paragraph.startswith("|") else [paragraph]
        for cell in cells:
            for sentence in END.split(" ".join(cell.split())):
                if sentence.strip("*_-| "):
                    is_heading = paragraph.startswith("#")
                    yield Sentence(line + start, sentence.lstrip("*_-#>|( ").strip(), is_heading)


def of_code(source: str) -> Iterator[Sentence]:
    """Yield the sentences of all docstrings and comments of a module."""
    for node in _statements(ast.parse(source)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            yield from of_text(cleandoc(node.value.value), node.lineno)
    for line, comment in _comments(source) if "#" in source else ():
        yield from of_text(comment, line)


def _statements(block: ast.AST) -> Iterator[ast.AST]:
    """Yield the statements in a block, and in theirs; expressions, which are ten times as many, have none."""
    for name in ("body", "orelse", "finalbody", "handlers", "cases"):
        inside = getattr(block, name, ())
        for node in inside if isinstance(inside, list) else ():
            yield node
            yield from _statements(node)


def of_file(path: Path) -> list[Sentence]:
    """Return the sentences of a page or a module."""
    text = path.read_text(encoding="utf-8")
    return list(of_code(text) if path.suffix == ".py" else of_text(text))


def _as_one_word(span: re.Match[str]) -> str:
    return "`code`" + "\n" * span[0].count("\n")


def _as_empty_lines(block: re.Match[str]) -> str:
    return "\n" * block[0].count("\n")


def _paragraphs(text: str) -> Iterator[tuple[int, str]]:
    """Yield each paragraph, list item and row of a table, with the number of its first line, from 0."""
    start, lines = 0, list[str]()
    for number, line in enumerate(text.splitlines()):
        if lines and (not line.strip() or NEW_UNIT.match(line)):
            yield start, " ".join(lines)
            lines = []
        if line.strip():
            start = start if lines else number
            lines.append(re.sub(r"^\s*(?:[-*]|\d+\.) ", "", line).strip())
    if lines:
        yield start, " ".join(lines)


def _comments(source: str) -> Iterator[tuple[int, str]]:
    """Yield each comment, of one or several lines, as one text, with the number of its first line."""
    start, last, trailed, lines = 0, -1, False, list[str]()
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type != tokenize.COMMENT or TOOLS.match(token.string):
            continue
        trails = not token.line.lstrip().startswith("#")
        if lines and (trails or trailed or token.start[0] != last + 1):
            yield start, "\n".join(lines)
            lines = []
        trailed = trails
        start = start if lines else token.start[0]
        last = token.start[0]
        lines.append(token.string.lstrip("# "))
    if lines:
        yield start, "\n".join(lines)
