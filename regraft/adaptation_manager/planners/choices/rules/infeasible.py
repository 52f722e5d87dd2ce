"""Why nothing is left to choose: a smallest set of rules that leave nothing together."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import Final

from regraft.adaptation_manager.planners.choices.rules.allowed_combinations import Search, TooHard
from regraft.adaptation_manager.planners.choices.rules.rules import Rule

STEPS_PER_SUSPECT: Final = 5_000
MAX_NAMED: Final = 8


def impossible(sizes: Sequence[int], members: Sequence[int], rules: Sequence[Rule], texts: Sequence[str]) -> str:
    """Return which sources of ``rules`` leave nothing of the slots ``members``: without any of them there is something.

    Where it is hard to find out, a source counts as one of them. ``texts`` describe the sources.
    """
    guilty = list(rules)
    for source in sorted({rule.source for rule in rules}, reverse=True):
        others = [rule for rule in guilty if rule.source != source]
        with suppress(TooHard):
            if not Search(sizes, members, others, STEPS_PER_SUSPECT).solutions(1):
                guilty = others
    sources = sorted({rule.source for rule in guilty})
    named = " and ".join(f"{texts[source]}," for source in sources[:MAX_NAMED])
    if len(sources) > MAX_NAMED:
        named += f" and {len(sources) - MAX_NAMED} more"
    verb = "leaves" if len(sources) == 1 else "together leave"
    return f"{named} {verb} no option: change {'it' if len(sources) == 1 else 'one of them'}"
