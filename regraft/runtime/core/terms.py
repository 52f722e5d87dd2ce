"""Terms: changes come from the adaptation manager's current term. A later one replaces it, if it can have begun."""

from __future__ import annotations

MAX_LEAP = 1000
"""Terms that may have begun without a word to a host or component: the manager begins one with each of its starts."""


class Fenced(Exception):
    """A change that does not come from the manager's current term; the text states which is."""


def in_force(given: int | None, current: int, known: int | None = None) -> int:
    """Return the term that holds from here on; raises Fenced if the ``given`` one is former, or cannot have begun.

    ``known`` is the highest term that is known to have begun, None if that is unknown. The first term of all may
    be any: the journal of earlier runs counts on.
    """
    if given is None or given < current:
        given_in_words = "no term" if given is None else f"term {given}"
        raise Fenced(
            f"came with {given_in_words}; the adaptation manager's current term is {current}: "
            "changes go through POST /adaptations or 'regraft adapt'"
        )
    if known is None:
        known = current + MAX_LEAP if current else given
    if given > max(current, known):
        raise Fenced(f"came with term {given}, which has not begun; the adaptation manager's current term is {current}")
    return given
