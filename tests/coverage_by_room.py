"""Prints how much of each room the tests of `make coverage` reach, and keeps the table in build/coverage/rooms.txt."""

from __future__ import annotations

import json
from collections import Counter
from datetime import date
from pathlib import Path
from typing import Any

FOLDER = Path("build/coverage")
REACHED, ALL = ("covered_lines", "covered_branches"), ("num_statements", "num_branches")


def by_room(files: dict[str, Any]) -> dict[str, tuple[int, int]]:
    """Return how many statements and branches of each room are reached, and how many there are; the last is of all."""
    reached, there = Counter[str](), Counter[str]()
    for name, file in files.items():
        first, *more = Path(name).parts
        room = f"{first}/{more[0]}" if first == "regraft" and len(more) > 1 else first
        for key in (room, "all"):
            reached[key] += sum(file["summary"][count] for count in REACHED)
            there[key] += sum(file["summary"][count] for count in ALL)
    return {room: (reached[room], there[room]) for room in (*sorted(there.keys() - {"all"}), "all") if there[room]}


def main() -> None:
    """Print the table and keep it."""
    found = by_room(json.loads((FOLDER / "report.json").read_text(encoding="utf-8"))["files"])
    lines = [f"{room:28}{there:8}{100 * reached / there:8.1f} %" for room, (reached, there) in found.items()]
    lines[-1] += f"  of statements and branches are reached by the tests ({date.today()})"
    table = "\n".join(lines) + "\n"
    (FOLDER / "rooms.txt").write_text(table, encoding="utf-8")
    print(table, end="")


if __name__ == "__main__":
    main()
