"""Where a mission's tree comes from, and how it is made."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from services.bt_executor.engine import Blackboard, Registry, Tree, TreeError, load_file, load_text

LONGEST_XML = 250_000
"""Characters; reading more could take so long that the host takes the executor for hung."""
MOST_NODES = 10_000
LONGEST_TEXT = 10_000
"""Characters of one path or port."""
LONGEST_TEXTS = 4_000_000
"""Characters of all paths and ports together: the mission's status tells them each second."""


class Unloadable(Exception):
    """A tree that cannot be built; the text names file, line and node."""


@dataclass(frozen=True, slots=True)
class Source:
    """A tree's XML: a file, or text whose relative includes start from ``folder``.

    Attributes:
        file: The file, empty where there is text.
        text: The XML text, empty where there is a file.
        main: The ID of the tree to execute, by default what the XML says.
        folder: Where relative includes of text start from.
    """

    file: str = ""
    text: str = ""
    main: str = ""
    folder: str = ""

    def load(self, registry: Registry, board: Blackboard) -> Tree:
        """Make the tree, with ``board`` as its top blackboard and source of time.

        Raises:
            Unloadable: it cannot be built.
        """
        try:
            if self.file:
                check_length(Path(self.file).stat().st_size, self.file)
                tree = load_file(self.file, registry, main=self.main, blackboard=board)
            else:
                check_length(len(self.text))
                folder = Path(self.folder or ".")
                tree = load_text(self.text, registry, main=self.main, blackboard=board, folder=folder)
        except TreeError as error:
            node = f" (node '{error.node}')" if error.node and error.node not in str(error) else ""
            raise Unloadable(f"{error}{node}") from error
        except OSError as error:
            raise Unloadable(f"cannot read {self.file or 'an included file'}: {error.strerror}") from error
        # What an author's node does when it is made is not for us to say.
        except Exception as error:
            raise Unloadable(f"a node could not be made: {type(error).__name__}: {error}") from error
        check_size(tree)
        return tree


def check_length(length: int, file: str = "") -> None:
    """Make sure that a tree's XML is soon read; raises TreeError."""
    if length > LONGEST_XML:
        raise TreeError(f"the tree's XML has {length} characters: at most {LONGEST_XML}", file=file)


def check_size(tree: Tree) -> None:
    """Make sure that a tree can be told of; raises Unloadable."""
    counted = "counting each use of a sub-tree"
    if len(tree.nodes) > MOST_NODES:
        raise Unloadable(f"the tree '{tree.tree_id}' has {len(tree.nodes)} nodes, {counted}: at most {MOST_NODES}")
    texts = 0
    for node in tree.nodes:
        told = {"name": tree.tree_id, "path": node.path, **node.setup.attributes}
        for what, text in told.items():
            if len(text) > LONGEST_TEXT:
                place = f"{node.setup.file or '<text>'}:{node.setup.line}: "
                raise Unloadable(f"{place}{node.type_id}'s {what} has {len(text)} characters: at most {LONGEST_TEXT}")
            texts += len(text)
    if texts > LONGEST_TEXTS:
        what = f"the paths and ports of the tree '{tree.tree_id}' have {texts} characters, {counted}"
        raise Unloadable(f"{what}: at most {LONGEST_TEXTS}")
