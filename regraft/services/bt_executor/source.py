"""Where a mission's tree comes from, and how it is made."""

from __future__ import annotations

import gc
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from importlib.metadata import entry_points
from pathlib import Path
from typing import Final

from behavior_tree import (
    Blackboard,
    Limits,
    Registry,
    Tree,
    TreeError,
    TreeLibrary,
    load_file,
    load_from_library,
    load_text,
)
from behavior_tree.nav2 import PauseResumeController
from regraft.process.modules import package_folder

TREE_ENTRY_POINTS: Final = "regraft.trees"
"""The entry point group of trees from packages: each names the package whose folder has XML files."""
MAX_TEXT_LENGTH = 10_000
"""Characters of one path or port."""
LIMITS = Limits(xml=250_000, nodes=10_000, characters=250_000, text=MAX_TEXT_LENGTH)
"""A larger tree could take so long to make that the host takes the executor for hung."""
MAX_TEXTS = 4_000_000
"""Characters of all paths and ports together: the mission's status publishes them each second."""


MAX_REASON_LENGTH: Final = 1_000
"""Characters of the reason why a tree cannot be built."""
_END_LENGTH: Final = 200


@contextmanager
def _no_collection() -> Iterator[None]:
    """Look for no garbage meanwhile: a tree leaves hardly any, and looking for it holds up all threads."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


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

    Without file and text, the tree is that of the library with the ID ``main``.
    """

    file: str = ""
    text: str = ""
    main: str = ""
    folder: str = ""

    def load(
        self, registry: Registry, board: Blackboard, limits: Limits = LIMITS, library: TreeLibrary | None = None
    ) -> Tree:
        """Make the tree, with ``board`` as its top blackboard and source of time, and sub-trees of ``library``.

        Raises:
            Unloadable: it cannot be built.
        """
        with _no_collection():
            try:
                tree = self._loaded(registry, board, limits, library or TreeLibrary())
                check_size(tree)
                return tree
            except TreeError as error:
                node = f" (node '{error.node}')" if error.node and error.node not in str(error) else ""
                reason = shortened(f"{error}{node}")
        # Here the error is gone, and with it the part of the tree that was made: not later, on the mission's thread.
        raise Unloadable(reason)

    def _loaded(self, registry: Registry, board: Blackboard, limits: Limits, library: TreeLibrary) -> Tree:
        if not (self.file or self.text):
            return load_from_library(self.main, library, registry, blackboard=board, limits=limits)
        load = partial(load_file, self.file) if self.file else partial(load_text, self.text, folder=Path(self.folder))
        return load(registry, main=self.main, blackboard=board, limits=limits, library=library)


def shortened(reason: str) -> str:
    """Return a reason, without its middle if it is too long: it may quote names and values of any length."""
    if len(reason) <= MAX_REASON_LENGTH:
        return reason
    return f"{reason[: MAX_REASON_LENGTH - _END_LENGTH]} … {reason[-_END_LENGTH:]}"


def library_of(paths: Iterable[str | Path]) -> TreeLibrary:
    """Return the trees of installed packages, and those of folders and files; raises Unloadable.

    A package has an entry point of the group `TREE_ENTRY_POINTS`, which names the package whose folder has its trees.
    """
    library = TreeLibrary(limits=LIMITS)
    found = entry_points(group=TREE_ENTRY_POINTS)
    packages = [(entry.value, package_folder(entry.value)) for entry in sorted(found, key=lambda entry: entry.name)]
    try:
        for place, folder in packages:
            if folder is None:
                raise Unloadable(f"there is no package {place!r}, whose trees are to be in the library")
            library.add_folder(folder)
        for path in paths:
            if not Path(path).exists():
                raise Unloadable(f"trees: '{path}': there is no such file or folder")
            (library.add_folder if Path(path).is_dir() else library.add_file)(path)
    except OSError as error:
        raise Unloadable(f"trees: {error}") from None
    except TreeError as error:
        raise Unloadable(str(error)) from None
    return library


def warnings_of(tree: Tree) -> tuple[str, ...]:
    """Return the doubts about a tree, with file and line: the loader's, and the nodes that nobody can pause."""
    unpausable = (
        f"{node.setup.file or '<text>'}:{node.setup.line}: {node.type_id} '{node.name}' cannot be paused: "
        "the services that it names are not offered"
        for node in tree.nodes
        if isinstance(node, PauseResumeController)
    )
    # A sub-tree may be used many times.
    return (*tree.warnings, *dict.fromkeys(unpausable))


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
