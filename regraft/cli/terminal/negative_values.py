"""Commands that take values as arguments: a negative number there is no option, although both begin with ``-``."""

from __future__ import annotations

import re
from collections.abc import Iterable
from itertools import islice
from typing import Any

from typer.core import TyperCommand, TyperOption

NEGATIVE = re.compile(r"-(\d|\.\d|\.inf)", re.IGNORECASE)


class TakesValues(TyperCommand):
    """A command whose arguments may be negative numbers; none of its options begins with a digit."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the words of the command line."""
        with_value = {
            name
            for option in self.params
            if isinstance(option, TyperOption) and not option.is_flag
            for name in option.opts
        }
        return super().parse_args(ctx, options_first(args, with_value))


def options_first(words: list[str], with_value: Iterable[str]) -> list[str]:
    """Return words with all arguments behind ``--`` if a negative number is among them.

    ``with_value`` are the options of which each takes the next word as its value.

    >>> options_first(["listener", "offset", "-0.5", "--reason", "-1", "--json"], {"--reason"})
    ['--reason', '-1', '--json', '--', 'listener', 'offset', '-0.5']
    """
    options: list[str] = []
    arguments: list[str] = []
    left = iter(words)
    for word in left:
        if word == "--":
            arguments += left
        elif len(word) > 1 and word.startswith("-") and not NEGATIVE.match(word):
            options.append(word)
            options += islice(left, 1) if word in with_value else ()
        else:
            arguments.append(word)
    return [*options, "--", *arguments] if any(map(NEGATIVE.match, arguments)) else words
