"""Where a mission's tree comes from, and how it is made."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from behavior_tree import Blackboard, Limits, Registry, Tree, TreeError, load_file, load_text

MAX_TEXT_LENGTH = 10_000
"""Characters of one path or port."""
LIMITS = Limits(xml=250_000, nodes=10_000, characters=250_000, text=MAX_TEXT_LENGTH)
"""A larger tree could take so long to make that the host takes the executor for hung."""
MAX_TEXTS = 4_000_000
"""Characters of all paths and ports together: the mission's status publishes them each second."""


class Unloadable(Exception):
    """A tree that cannot be built; the text names file, line and node."""


@dataclass(frozen=True, slots=True)
class Source:
    """A tree's XML: a file, or text whose relative includes start from ``folder``.

    Attributes:
        file: The file, empty where there is text.
        text: The XML text, empty where there is a file.
        main: The ID of the tree to execute, by default what the XML states.
        folder: Where relative includes of text start from.
    """

    file: str = ""
    text: str = ""
    main: str = ""
    folder: str = ""

    def load(self, registry: Registry, board: Blackboard, limits: Limits = LIMITS) -> Tree:
        """Make the tree, with ``board`` as its top blackboard and source of time.

        Raises:
            Unloadable: it cannot be built.
        """
        try:
            tree = self._loaded(registry, board, limits)
            check_size(tree)
            return tree
        except TreeError as error:
            node = f" (node '{error.node}')" if error.node and error.node not in str(error) else ""
            raise Unloadable(f"{error}{node}") from error

    def _loaded(self, registry: Registry, board: Blackboard, limits: Limits) -> Tree:
        if self.file:
            return load_file(self.file, registry, main=self.main, blackboard=board, limits=limits)
        folder = Path(self.folder or ".")
        return load_text(self.text, registry, main=self.main, blackboard=board, folder=folder, limits=limits)


def check_size(tree: Tree) -> None:
    """Make sure that a tree can be published; raises TreeError."""
    texts = 0
    for node in tree.nodes:
        told = {"name": tree.tree_id, "path": node.path, **node.setup.attributes}
        for what, text in told.items():
            if len(text) > MAX_TEXT_LENGTH:
                wrong = f"{node.type_id}'s {what} has {len(text)} characters: at most {MAX_TEXT_LENGTH}"
                raise TreeError(wrong, file=node.setup.file, line=node.setup.line)
            texts += len(text)
    if texts > MAX_TEXTS:
        what = f"the paths and ports of the tree '{tree.tree_id}' have {texts} characters"
        raise TreeError(f"{what}, counting each use of a sub-tree: at most {MAX_TEXTS}")
