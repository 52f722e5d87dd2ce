"""Writes plain data as YAML that is read again as what it is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import yaml

from regraft.stack.yaml.nodes import NumberTooLarge, scalar


class _Dumper(yaml.SafeDumper):
    """Quotes the texts that YAML 1.2 takes for something else. Those of YAML 1.1 are quoted by the base."""


def dumped(document: Mapping[str, Any]) -> str:
    """Return a map as the text of a file."""
    return yaml.dump(document, Dumper=_Dumper, sort_keys=False, width=120)


def _text(dumper: yaml.SafeDumper, text: str) -> yaml.Node:
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=None if _is_text(text) else "'")


def _is_text(text: str) -> bool:
    try:
        return scalar(text) == text
    except NumberTooLarge:
        return False


_Dumper.add_representer(str, _text)
