"""Everything that can go wrong with a tree, as one family of exceptions."""


class TreeError(Exception):
    """The base of all errors of this library.

    Attributes:
        file: The file that the fault is in, or an empty string where there is none.
        line: The line in that file, counted from 1, or 0 where there is none.
        node: The path of the node concerned, or an empty string.
    """

    def __init__(self, message: str, *, file: str = "", line: int = 0, node: str = "") -> None:
        self.message = message
        self.file = file
        self.line = line
        self.node = node
        super().__init__(message)

    def __str__(self) -> str:
        """Return the message behind its place, in the form ``file:line: message``."""
        place = f"{self.file or '<text>'}:{self.line}: " if self.line else ""
        return f"{place}{self.message}"


class LoadError(TreeError):
    """A tree cannot be built from its XML."""


class UnknownTypeError(LoadError):
    """A node of the tree has a type that is not known; ``hint`` states which may be meant, empty if none is near."""

    hint = ""


class RegistryError(TreeError):
    """A node type or one of its ports cannot be registered."""


class ScriptError(TreeError):
    """A script cannot be parsed, or fails while it runs."""


class BlackboardError(TreeError):
    """A blackboard entry is missing, empty, or of another type."""


class PortError(TreeError):
    """A port cannot be read or written."""


class NodeError(TreeError):
    """A node failed while it was ticked or halted; the original exception is the ``__cause__``."""
