"""How large a tree may be: making one takes time, and its XML may come from anywhere."""

from dataclasses import dataclass

from ..errors import LoadError


@dataclass(frozen=True, slots=True)
class Size:
    """How large a tree is, each use of a sub-tree counted.

    Attributes:
        depth: Levels of nodes.
        nodes: Nodes.
        characters: Characters of all attributes.
    """

    depth: int
    nodes: int
    characters: int


@dataclass(frozen=True, slots=True)
class Limits:
    """The limits of a tree.

    Attributes:
        xml: Characters of its XML, all included files together.
        nodes: Nodes, each use of a sub-tree counted.
        characters: Characters of all attributes, each use of a sub-tree counted.
        text: Characters of one attribute, None for any number.
        seconds: How long making the nodes may take, None for any time; it is looked at after each node.
    """

    xml: int
    nodes: int
    characters: int
    text: int | None = None
    seconds: float | None = None

    def check_xml(self, length: int, file: str) -> None:
        """Make sure that the XML read so far, up to a file, is not too long; raises LoadError."""
        if length > self.xml:
            read = f", '{file}' included" if file else ""
            raise LoadError(f"the tree's XML has {length} characters{read}: at most {self.xml}", file=file)

    def check(self, tree_id: str, size: Size) -> None:
        """Make sure that a tree is not too large; raises LoadError."""
        counted = "counting each use of a sub-tree"
        if size.nodes > self.nodes:
            raise LoadError(f"the tree '{tree_id}' has {size.nodes} nodes, {counted}: at most {self.nodes}")
        if size.characters > self.characters:
            what = f"the attributes of the tree '{tree_id}' have {size.characters} characters, {counted}"
            raise LoadError(f"{what}: at most {self.characters}")
