"""The tree author's policy for an adaptation that came to nothing."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

_POLICY: Final = re.compile(r"retry(?: +(?P<times>\d{1,4}))?(?: +then +(?P<then>ignore|fail))?")
RETRIES: Final = 3
"""How often ``retry`` without a number tries again."""


@dataclass(frozen=True, slots=True)
class Policy:
    """How often to try again, and whether the decorator fails after that; else it continues unchanged."""

    retries: int = 0
    fails: bool = False


def read_policy(text: str) -> Policy:
    """Return the policy that ``ignore``, ``fail``, ``retry``, ``retry 5`` or ``retry 5 then fail`` represents.

    Raises:
        ValueError: the text is something else.
    """
    text = " ".join(text.split())
    if text in ("ignore", "fail"):
        return Policy(fails=text == "fail")
    found = _POLICY.fullmatch(text)
    if found is None:
        raise ValueError(f"'{text}' is no policy; write ignore, fail, retry, retry 5, or retry 5 then fail")
    times = found["times"]
    return Policy(RETRIES if times is None else int(times), found["then"] == "fail")
