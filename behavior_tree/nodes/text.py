"""How attributes refer to blackboard entries."""


def board_key(text: str, port: str) -> str | None:
    """Return the key that an attribute like ``{key}`` names, or None if it is a literal.

    Args:
        text: The attribute's value.
        port: The port's name, which ``{=}`` represents.
    """
    text = text.strip()
    if not (text.startswith("{") and text.endswith("}")):
        return None
    key = text[1:-1].strip()
    if not key or "{" in key or "}" in key:
        return None
    return port if key == "=" else key
