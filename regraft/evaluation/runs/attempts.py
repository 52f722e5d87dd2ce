"""Attempts at runs: why one failed, whether the machine is to blame, and the log of all attempts of a campaign."""

from __future__ import annotations

import csv
import json
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import astuple, dataclass, fields
from enum import Enum
from pathlib import Path
from typing import Any, Final

from regraft.bus_schema.messages.protocol.clock import CauseCode

LOG: Final = "attempts.csv"
NOT_STARTED, STALLED, FAILED, INCOMPLETE = "not_started", "stalled", "failed", "incomplete"
"""Causes that the campaign itself finds: no first row, no further row, an end with an error, rows that are missing."""
OF_THE_MACHINE: Final = frozenset(
    {
        NOT_STARTED,
        STALLED,
        CauseCode.SILENT.value,
        CauseCode.NOT_JOINED.value,
        CauseCode.UNWIRED.value,
        CauseCode.MESSAGES_LOST.value,
        CauseCode.HUNG.value,
    }
)
"""Causes that a busy machine may have: the same run may succeed later."""


class Outcome(Enum):
    """The end of an attempt: ``repeated`` failed and is made again, ``interrupted`` ended with its campaign."""

    KEPT = "kept"
    FAILED = "failed"
    REPEATED = "repeated"
    INTERRUPTED = "interrupted"


@dataclass(frozen=True, slots=True)
class Cause:
    """One cause of a failed attempt; ``component`` is empty where it is the whole run's."""

    code: str
    component: str = ""
    text: str = ""

    @property
    def named(self) -> str:
        """Its code, and whose it is."""
        return f"{self.code} ({self.component})" if self.component else self.code

    @property
    def of_the_machine(self) -> bool:
        """Whether the machine may be to blame."""
        return self.code in OF_THE_MACHINE


def causes_in(closing: Mapping[str, Any]) -> tuple[Cause, ...]:
    """Return the causes that the closing line of a run has."""
    found = closing.get("causes") or ()
    return tuple(Cause(each["code"], each["component"], each.get("text", "")) for each in found)


def decisive(causes: Iterable[Cause]) -> Cause:
    """Return the cause that counts: the first that is not the machine's, else the first."""
    found = list(causes)
    return next((cause for cause in found if not cause.of_the_machine), found[0] if found else Cause(FAILED))


def told(causes: Sequence[Cause]) -> str:
    """Return the cause that counts, for people."""
    cause = decisive(causes)
    return f"{cause.named}: {cause.text}" if causes else "no cause is known"


@dataclass(frozen=True, slots=True)
class Attempt:
    """One attempt at a run, as a line of the log; ``began`` is a date and time, ``code`` begins a `code_hash`."""

    run: str
    seed: int
    began: str
    wall_s: float
    outcome: Outcome
    cause: str = ""
    component: str = ""
    text: str = ""
    code: str = ""


class AttemptLog:
    """The attempts of a campaign, in the order of their ends, in a file of its folder."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / LOG

    def add(self, attempt: Attempt) -> None:
        """Write an attempt; raises OSError."""
        with self._path.open("a+", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            is_new = file.tell() == 0
            if not is_new:
                file.seek(file.tell() - 1)
                file.write("" if file.read() == "\n" else "\n")  # a kill has cut the last line short
            if is_new:
                writer.writerow(each.name for each in fields(Attempt))
            cells = astuple(attempt)
            writer.writerow(cell.value if isinstance(cell, Outcome) else cell for cell in cells)

    def read(self) -> list[Attempt]:
        """Return all attempts; a line that a kill has cut short is left out."""
        try:
            with self._path.open(newline="") as file:
                lines = list(csv.DictReader(file))
        except OSError:
            return []
        found = []
        for line in lines:
            try:
                found.append(_attempt(**line))
            except (TypeError, ValueError, KeyError):
                continue
        return found


def _attempt(seed: str, wall_s: str, outcome: str, **texts: str) -> Attempt:
    return Attempt(seed=int(seed), wall_s=float(wall_s), outcome=Outcome(outcome), **texts)


def repeats_text(attempts: Sequence[Attempt], kept: Iterable[str]) -> list[str]:
    """Return how many of the runs that were ``kept`` were made again and why, as sentences."""
    wanted = set(kept)
    bad = [each for each in attempts if each.run in wanted and each.outcome is not Outcome.KEPT]
    failed = [each for each in bad if each.outcome is not Outcome.INTERRUPTED]
    cut = len(bad) - len(failed)
    if not failed:
        text = ["No run failed before it was kept."]
    else:
        runs = len({each.run for each in failed})
        times = f"**{runs} of {len(wanted)} runs were made again**, after {len(failed)} failed attempts:"
        counted = Counter(Cause(each.cause, each.component).named for each in failed)
        text = [f"{times} {', '.join(f'{count} x {name}' for name, count in sorted(counted.items()))}."]
    if cut:
        text.append(f"{cut} attempts ended with the campaign, and were made again when it continued.")
    return text


def error_in(complaints: str) -> Cause | None:
    """Return the error that a command has printed as one JSON object, None without one."""
    for line in reversed(complaints.splitlines()):
        try:
            found = json.loads(line)
            return Cause(str(found["code"]), "", str(found["error"]))
        except (ValueError, KeyError, TypeError):
            continue
    return None
