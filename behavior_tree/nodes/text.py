"""How attributes refer to blackboard entries."""

import re
from typing import Final

_REFERENCE: Final = re.compile(r"\s*\{\s*([^{}\s][^{}]*?)\s*\}\s*")


def board_key(text: str, port: str) -> str | None:
    """Return the key that an attribute like ``{key}`` names, or None if it is a literal.

    Args:
        text: The attribute's value.
        port: The port's name, which ``{=}`` represents.
    """
    found = _REFERENCE.fullmatch(text)
    if found is None:
        return None
    key = found.group(1)
    return port if key == "=" else key
