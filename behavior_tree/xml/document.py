"""Parses XML text into elements that know their line."""

from dataclasses import dataclass, field
from typing import Final
from xml.parsers import expat

from ..errors import LoadError, UnknownTypeError
from .mending import mended

MAX_NESTING: Final = 256
"""Levels of nodes in one tree, as in BehaviorTree.CPP."""
_LEVELS_ABOVE_NODES: Final = 2  # <root> and <BehaviorTree>


@dataclass(slots=True)
class Element:
    """An XML element.

    Attributes:
        tag: The name of the element.
        attributes: The values by name.
        file: The file it comes from, empty for text.
        line: Its line in that file.
        children: The elements inside.
        text: The characters directly inside.
    """

    tag: str
    attributes: dict[str, str]
    file: str
    line: int
    children: "list[Element]" = field(default_factory=list)
    text: str = ""

    def children_of(self, tag: str) -> "list[Element]":
        """Return the direct children with a tag."""
        return [child for child in self.children if child.tag == tag]

    @property
    def place(self) -> str:
        """The file and line, for messages."""
        return f"{self.file or '<text>'}:{self.line}"

    def error(self, message: str) -> LoadError:
        """Return an error that names this element and its place."""
        return LoadError(message, file=self.file, line=self.line, node=self._shown_name())

    def unknown_type(self, type_id: str, hint: str) -> UnknownTypeError:
        """Return the error that this element's type is not known."""
        message = f"unknown node type '{type_id}'{hint}"
        error = UnknownTypeError(message, file=self.file, line=self.line, node=self._shown_name())
        error.hint = hint
        return error

    def _shown_name(self) -> str:
        return self.attributes.get("name") or self.attributes.get("ID") or self.tag


def parse_document(text: str, file: str) -> Element:
    """Return the root element of an XML document.

    Raises:
        LoadError: The text is not well-formed, nested too deeply, or declares entities.
    """
    return _Builder(file).parse(text)


def parse_leniently(text: str, file: str) -> tuple[Element, str]:
    """Return the root element of a document that may need mending (`mending`), and what was wrong, if anything.

    Raises:
        LoadError: It is faulty all the same; the error is about the document as it was given.
    """
    try:
        return parse_document(text, file), ""
    except LoadError as error:
        try:
            return parse_document(mended(text), file), f"{error}; read leniently"
        except LoadError:
            raise error from None


class _Builder:
    def __init__(self, file: str) -> None:
        self._file = file
        self._open: list[Element] = []
        self._root: Element | None = None
        self._parser = expat.ParserCreate()
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.CharacterDataHandler = self._characters
        self._parser.EntityDeclHandler = self._entity

    def parse(self, text: str) -> Element:
        try:
            self._parser.Parse(text, True)
        except expat.ExpatError as error:
            reason = expat.errors.messages[error.code]
            message = f"not well-formed XML: {reason} (column {error.offset + 1})"
            raise LoadError(message, file=self._file, line=error.lineno) from None
        except (LookupError, ValueError) as error:
            message = f"not well-formed XML: {error}"  # Characters that no encoding has, or an unknown encoding.
            raise LoadError(message, file=self._file, line=max(self._parser.CurrentLineNumber, 1)) from None
        if self._root is None:
            raise LoadError("the document has no root element", file=self._file, line=1)
        return self._root

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        element = Element(tag, attributes, self._file, self._parser.CurrentLineNumber)
        if len(self._open) >= MAX_NESTING + _LEVELS_ABOVE_NODES:
            raise element.error(f"<{tag}> is nested deeper than {MAX_NESTING} levels")
        if self._open:
            self._open[-1].children.append(element)
        else:
            self._root = element
        self._open.append(element)

    def _end(self, _tag: str) -> None:
        self._open.pop()

    def _characters(self, text: str) -> None:
        self._open[-1].text += text

    def _entity(self, name: str, *_details: object) -> None:
        line = self._parser.CurrentLineNumber
        raise LoadError(f"entity '{name}': a tree's XML must not declare entities", file=self._file, line=line)
