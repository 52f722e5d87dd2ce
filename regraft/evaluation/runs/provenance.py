"""The section of a report on how its runs were made: of which code, and which of them again and why."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from regraft.evaluation.runs.attempts import Attempt, repeats_text
from regraft.evaluation.runs.fingerprint import SHOWN, Fingerprint


def provenance(
    made_of: Mapping[str, Fingerprint | None],
    present: Fingerprint | None,
    renderers: Mapping[str, int],
    attempts: Sequence[Attempt],
) -> str:
    """Return the section. ``made_of`` has each finished run by its name, ``present`` is what one is made of now.

    ``renderers`` are what drew the pictures, each of so many runs.
    """
    drawn = [f"The pictures of {count} runs were drawn by {name}." for name, count in sorted(renderers.items()) if name]
    lines = [*_codes(made_of, present), *_versions(made_of), *drawn, *repeats_text(attempts, made_of)]
    return "\n".join(["## How the runs were made", "", *(f"- {line}" for line in lines)]) + "\n"


def _codes(made_of: Mapping[str, Fingerprint | None], present: Fingerprint | None) -> list[str]:
    counted = Counter("" if each is None else each.code for each in made_of.values())
    lines = []
    for code, count in sorted(counted.items()):
        how = f"code `{code[:SHOWN]}`" if code else "code of which there is no record"
        now = (
            f", which is `{present.code[:SHOWN]}` now" if present is not None and code not in ("", present.code) else ""
        )
        lines.append(f"{count} runs were made with {how}{now}.")
    if len(counted) > 1:
        lines.append("**The runs are not of one code**: differences between them may be the code's.")
    return lines


def _versions(made_of: Mapping[str, Fingerprint | None]) -> list[str]:
    counted = Counter(
        ", ".join(f"{name} {value}" for name, value in sorted(each.dependencies.items()))
        for each in made_of.values()
        if each is not None
    )
    return [f"{count} runs were made with {which}." for which, count in sorted(counted.items())]
