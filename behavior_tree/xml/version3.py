"""Converts trees of BehaviorTree.CPP's version 3 to version 4; comments, blanks and the order of attributes stay.

The rules are those of its page on migration, and of version 3.8's parser for sub-trees. A node that has no equivalent
stays as it is and is named. Included files are converted each on its own.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

from ..data.values import TRUTH_VALUES
from ..errors import LoadError
from ..nodes.manifest import CONDITION_ATTRIBUTES, NodeKind
from .document import Element, parse_document, parse_leniently
from .mending import mended

_MARKUP: Final = re.compile(
    r"<!--.*?-->|<!\[CDATA\[.*?\]\]>|<\?.*?\?>"
    r"""|<(?P<end>/?)(?P<tag>[^\s<>/!?"']+)(?P<rest>[^<>"']*+(?:"[^"]*+"[^<>"']*+|'[^']*+'[^<>"']*+)*+)>""",
    re.DOTALL,
)
_ATTRIBUTE: Final = re.compile(
    r"""(?P<before>\s+)(?P<name>[^\s=]+)\s*=\s*(?:"(?P<double>[^"]*)"|'(?P<single>[^']*)')"""
)
_DECLARED: Final = re.compile(r"""\A(\s*<\?xml\s[^>]{0,200}?encoding\s?=\s?["'])[A-Za-z0-9._:-]{1,40}(["'])""")
_NAMES: Final = {"SequenceStar": "SequenceWithMemory", "RetryUntilSuccesful": "RetryUntilSuccessful"}
_THRESHOLDS: Final = {"success_threshold": "success_count", "failure_threshold": "failure_count"}
_CHECKS: Final = ("BlackboardCheckInt", "BlackboardCheckDouble", "BlackboardCheckString", "BlackboardCheckBool")
_LONG_FORMS: Final = frozenset(kind.value for kind in NodeKind)
_KEY: Final = re.compile(r"\{\s*(@?[^\W\d]\w*)\s*\}")
_NUMBER: Final = re.compile(r"-?\d+(?:\.\d+)?")
_QUOTES: Final = re.compile(r"""['"]|&(?:apos|quot|#)""")


@dataclass(frozen=True, slots=True)
class Converted:
    """A converted document.

    Attributes:
        text: The document of version 4; if it declares an encoding, that is UTF-8.
        changed: Differences that may matter, each with file and line.
        left: Nodes without an equivalent, which stay for the author, each with file and line.
    """

    text: str
    changed: tuple[str, ...]
    left: tuple[str, ...]


def to_version_4(text: str, file: str = "") -> Converted:
    """Convert a document.

    Raises:
        LoadError: It is not well-formed, no document of trees, or of version 4 already.
    """
    root, doubt = parse_leniently(text, file)
    if root.tag != "root":
        raise root.error(f"the outermost element is <{root.tag}>; it must be <root>")
    if root.attributes.get("BTCPP_format") == "4":
        raise root.error('the document is of version 4 already: it has BTCPP_format="4"')
    conversion = _Conversion(mended(text) if doubt else text, file)
    converted = conversion.run()
    changed = [doubt, *conversion.changed] if doubt else conversion.changed
    _check(converted, file)
    return Converted(converted, tuple(changed), tuple(conversion.left))


def _check(text: str, file: str) -> Element:
    """Make sure that the result can be read; the conversion itself would be at fault."""
    try:
        return parse_document(text, file)
    except LoadError as error:
        raise LoadError(f"the document cannot be converted: {error.message}", file=file, line=error.line) from None


@dataclass(slots=True)
class _Tag:
    """A start tag: the name, and its attributes in order, with the blanks before each and the raw values."""

    name: str
    attributes: dict[str, tuple[str, str]]
    tail: str

    def value(self, name: str, default: str = "") -> str:
        return self.attributes[name][1] if name in self.attributes else default

    def rename(self, old: str, new: str) -> None:
        self.attributes = {new if name == old else name: value for name, value in self.attributes.items()}

    def set(self, name: str, value: str) -> None:
        before = self.attributes[name][0] if name in self.attributes else " "
        self.attributes[name] = before, value

    def text(self) -> str:
        parts = [f"{before}{name}={_quoted(value)}" for name, (before, value) in self.attributes.items()]
        return f"<{self.name}{''.join(parts)}{self.tail}>"


class _Conversion:
    def __init__(self, text: str, file: str) -> None:
        self.changed: list[str] = []
        self.left: list[str] = []
        self._text = text
        self._place = file or "<text>"
        self._line = 1
        self._open: list[str] = []
        self._rules: dict[str, Callable[[_Tag], None]] = {
            "SubTree": self._subtree,
            "SubTreePlus": self._subtree_plus,
            "Parallel": self._parallel,
            "ManualSelector": self._manual_selector,
            **dict.fromkeys(_CHECKS, self._check),
        }

    def run(self) -> str:
        return _DECLARED.sub(r"\1UTF-8\2", "".join(self._parts()), count=1)

    def _parts(self) -> Iterator[str]:
        position = 0
        for found in _MARKUP.finditer(self._text):
            self._line += self._text.count("\n", position, found.start())
            yield self._text[position : found.start()]
            yield self._converted(found) if found["tag"] else found.group()
            self._line += found.group().count("\n")
            position = found.end()
        yield self._text[position:]

    def _converted(self, found: re.Match[str]) -> str:
        if found["end"]:
            return f"</{self._open.pop()}{found['rest']}>"
        rest = found["rest"]
        attributes = {
            part["name"]: (part["before"], part["double"] if part["double"] is not None else part["single"])
            for part in _ATTRIBUTE.finditer(rest)
        }
        tail = _ATTRIBUTE.sub("", rest)
        tag = _Tag(found["tag"], attributes, tail)
        if "TreeNodesModel" in self._open:
            if tag.name in _LONG_FORMS and tag.value("ID") in _NAMES:
                tag.set("ID", _NAMES[tag.value("ID")])
        else:
            self._convert(tag)
        if not tail.rstrip().endswith("/"):
            self._open.append(tag.name)
        return tag.text()

    def _convert(self, tag: _Tag) -> None:
        if tag.name == "root":
            tag.set("BTCPP_format", "4")
            return
        is_long = tag.name in _LONG_FORMS and tag.name != "SubTree"
        type_id = tag.value("ID") if is_long else tag.name
        new = _NAMES.get(type_id, type_id)
        if new != type_id:
            self._name(tag, new)
        for name in CONDITION_ATTRIBUTES:
            if name in tag.attributes:
                self._note(self.left, f"{type_id}: {name} is a script in version 4; rename the port")
        if type_id in self._rules:
            self._rules[type_id](tag)

    @staticmethod
    def _name(tag: _Tag, type_id: str) -> None:
        if tag.name in _LONG_FORMS and tag.name != "SubTree":
            tag.set("ID", type_id)
        else:
            tag.name = type_id

    def _subtree(self, tag: _Tag) -> None:
        shared = tag.value("__shared_blackboard")
        if "__shared_blackboard" in tag.attributes:
            del tag.attributes["__shared_blackboard"]
        is_shared = TRUTH_VALUES.get(shared.strip(), False)
        for name, (_, value) in list(tag.attributes.items()):
            if name in ("ID", "name") or name.startswith("_"):
                continue
            if is_shared:
                del tag.attributes[name]
                self._note(self.changed, f"SubTree: '{name}' was ignored with a shared blackboard, and is left out")
            elif not _KEY.fullmatch(value):
                tag.set(name, f"{{{value}}}")
        if is_shared:
            tag.set("_autoremap", "true")
            self._note(
                self.changed, "SubTree: a shared blackboard is _autoremap now; keys that begin with _ are its own"
            )

    def _subtree_plus(self, tag: _Tag) -> None:
        tag.name = "SubTree"
        tag.rename("__autoremap", "_autoremap")

    def _parallel(self, tag: _Tag) -> None:
        for old, new in _THRESHOLDS.items():
            tag.rename(old, new)

    def _manual_selector(self, _tag: _Tag) -> None:
        self._note(self.left, "ManualSelector: version 4 has no such node; a Switch or a Fallback may do")

    def _check(self, tag: _Tag) -> None:
        kind = (tag.value("ID") if tag.name in _LONG_FORMS else tag.name).removeprefix("BlackboardCheck")
        operands = [_operand(kind, tag.value(name)) for name in ("value_A", "value_B")]
        if None in operands:
            values = " and ".join(repr(tag.value(name)) for name in ("value_A", "value_B"))
            self._note(self.left, f"BlackboardCheck{kind}: {values} cannot be compared in a script")
            return
        self._name(tag, "Precondition")
        tag.set("value_A", f"{operands[0]} == {operands[1]}")
        tag.rename("value_A", "if")
        del tag.attributes["value_B"]
        tag.rename("return_on_mismatch", "else")
        text = (
            f"BlackboardCheck{kind}: Precondition asks only when its child starts, and takes no entry that is missing"
        )
        self._note(self.changed, text)

    def _note(self, notes: list[str], text: str) -> None:
        notes.append(f"{self._place}:{self._line}: {text}")


def _operand(kind: str, value: str) -> str | None:
    """Return a value as a script has it; None if it has no form for it."""
    key = _KEY.fullmatch(value.strip())
    if key:
        return key[1]
    if kind == "Bool":
        truth = TRUTH_VALUES.get(value.strip())
        return None if truth is None else str(truth).lower()
    if kind == "String":
        return None if _QUOTES.search(value) else f"'{value}'"
    return value.strip() if _NUMBER.fullmatch(value.strip()) else None


def _quoted(raw: str) -> str:
    """Return an attribute's raw value in quotes that it does not have."""
    return f"'{raw}'" if '"' in raw else f'"{raw}"'
