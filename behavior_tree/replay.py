"""Replays traces: ``python -m behavior_tree.replay FILE.jsonl.gz …``.

The last line printed is ``trees: N, mismatching: M``. The exit code is 0 if all trees did as their traces. It is 1 if
some did not, and 2 if a file or a record in it cannot be read.
"""

import argparse
import gzip
import sys
import zlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from .traces import BadRecord, first_mismatch, parse_record

SHOWN: Final = 10
_GZIP: Final = b"\x1f\x8b"


class Unreadable(Exception):
    """A file cannot be read or holds something else; the text names it and, where known, the line."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Replay the files named on the command line and return the exit code."""
    parser = argparse.ArgumentParser(prog="replay", description="Replay traces of behaviour trees.")
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="JSON lines, gzipped or not")
    parser.add_argument("--show", type=int, default=SHOWN, help=f"mismatches to print, {SHOWN} by default")
    options = parser.parse_args(arguments)
    trees = mismatching = 0
    try:
        for path in options.files:
            for place, text in _lines(path):
                trees += 1
                difference = _replayed(place, text)
                if difference:
                    mismatching += 1
                    if mismatching <= options.show:
                        _print(f"{place}: {difference}")
    except Unreadable as error:
        sys.stderr.write(f"replay: {error}\n")
        return 2
    _print(f"trees: {trees}, mismatching: {mismatching}")
    return 1 if mismatching else 0


def _replayed(place: str, text: str) -> str:
    try:
        record = parse_record(text)
    except BadRecord as error:
        raise Unreadable(f"{place}: {error}") from None
    mismatch = first_mismatch(record)
    return str(mismatch) if mismatch else ""


def _lines(path: Path) -> Iterator[tuple[str, str]]:
    """Yield the records of a file, each with its place; blank lines are left out."""
    number = found = 0
    try:
        with path.open("rb") as file:
            is_packed = file.read(len(_GZIP)) == _GZIP
        with gzip.open(path) if is_packed else path.open("rb") as lines:
            for number, line in enumerate(lines, start=1):
                text = line.decode("utf-8-sig" if number == 1 else "utf-8")
                if text.strip():
                    found += 1
                    yield f"{path}:{number}", text
    except OSError as error:
        raise Unreadable(f"cannot read '{path}': {error.strerror or error}") from None
    except (EOFError, zlib.error, UnicodeDecodeError) as error:
        raise Unreadable(f"{path}:{number + 1}: {error}") from None
    if not found:
        raise Unreadable(f"'{path}' holds no records")


def _print(text: str) -> None:
    sys.stdout.write(text + "\n")


if __name__ == "__main__":
    sys.exit(main())
