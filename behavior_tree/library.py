"""A library of trees: files and folders are registered, and a tree is found by its ID.

    library = TreeLibrary()
    library.add_folder("trees")
    tree = load_from_library("Patrol", library, registry)

BehaviorTree.CPP registers trees with its factory. Here, trees that are not used are parsed and no more: their faults
do not matter, and neither does a file that cannot be read.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from itertools import islice
from pathlib import Path
from typing import Final

from .errors import LoadError
from .nodes.limits import Limits
from .nodes.manifest import NodeKind
from .xml.collection import Collector, TreeCollection
from .xml.document import Element

MAX_FILES: Final = 1_000
"""Files of a library."""
MAX_CHARACTERS: Final = 4_000_000
"""Characters of all its files together."""
SUFFIX: Final = ".xml"
_SHOWN: Final = 12


@dataclass(frozen=True, slots=True)
class _Place:
    tree: Element
    collection: TreeCollection


class TreeLibrary:
    """Trees by ID, of any number of files.

    Attributes:
        problems: Why files could not be read, each with its place; their trees are missing.
    """

    def __init__(self, *, search_path: Sequence[Path] = (), lenient: bool = True, limits: Limits | None = None) -> None:
        """Begin empty; see `load_file` for the arguments, which count for each file."""
        self.problems: list[str] = []
        self._search_path = search_path
        self._lenient = lenient
        self._limits = limits
        self._trees: dict[str, dict[str, _Place]] = {}
        self._files: set[Path] = set()
        self._characters = 0

    @property
    def ids(self) -> tuple[str, ...]:
        """The IDs of all trees, in order of their names."""
        return tuple(sorted(self._trees))

    def add_folder(self, folder: str | Path) -> None:
        """Register the XML files of a folder, and of all folders in it.

        Raises:
            LoadError: There is no such folder, or the library becomes too large.
        """
        folder = Path(folder)
        if not folder.is_dir():
            raise LoadError(f"'{folder}' is no folder of trees", file=str(folder))
        for path in sorted(islice(folder.rglob(f"*{SUFFIX}"), MAX_FILES + 1)):
            self.add_file(path)

    def add_file(self, path: str | Path) -> None:
        """Register the trees of a file, and of those that it includes.

        Raises:
            LoadError: The library becomes too large.
        """
        path = Path(path).resolve()
        if path in self._files:
            return
        if len(self._files) >= MAX_FILES:
            raise LoadError(f"the library of trees has more than {MAX_FILES} files", file=str(path))
        self._files.add(path)
        collector = Collector(self._search_path, self._lenient, self._limits)
        try:
            collector.add_file(path)
        except LoadError as error:
            self.problems.append(str(error))
            return
        self._characters += collector.length
        if self._characters > MAX_CHARACTERS:
            many = f"the files of the library of trees have {self._characters} characters"
            raise LoadError(f"{many}: at most {MAX_CHARACTERS}", file=str(path))
        for tree_id, tree in collector.collection.trees.items():
            if tree_id:
                self._trees.setdefault(tree_id, {}).setdefault(tree.place, _Place(tree, collector.collection))

    def complete(self, collection: TreeCollection, main: str = "") -> None:
        """Add the trees to a collection that its own trees, or its main tree, refer to; its own go first.

        Raises:
            LoadError: Two trees of the library have an ID that is needed.
        """
        pending = [main] if main else []
        pending += _uses(collection.trees.values())
        while pending:
            tree_id = pending.pop()
            if tree_id in collection.trees or tree_id not in self._trees:
                continue
            place = self._only(tree_id)
            collection.trees[tree_id] = place.tree
            collection.include(place.collection, tree_id)
            pending += _uses([place.tree])

    def missing(self, tree_id: str) -> LoadError:
        """Return the error that there is no tree of an ID; it names a near one, or those that there are."""
        near = get_close_matches(tree_id[:200], self._trees, n=1)
        shown = ", ".join(f"'{name}'" for name in self.ids[:_SHOWN]) or "none"
        more = f" and {len(self._trees) - _SHOWN} more" if len(self._trees) > _SHOWN else ""
        hint = f"did you mean '{near[0]}'?" if near else f"there are {shown}{more}"
        wrong = f"; not read: {'; '.join(self.problems[:3])}" if self.problems else ""
        return LoadError(f"there is no tree '{tree_id[:200]}' in the library of trees; {hint}{wrong}")

    def _only(self, tree_id: str) -> _Place:
        places = list(self._trees[tree_id].values())
        if len(places) > 1:
            others = ", ".join(place.tree.place for place in places[1:])
            raise places[0].tree.error(f"trees of the library have the same ID '{tree_id}'; the others are at {others}")
        return places[0]


def _uses(trees: Iterable[Element]) -> list[str]:
    found = []
    pending = list(trees)
    while pending:
        element = pending.pop()
        pending.extend(element.children)
        if element.tag == NodeKind.SUBTREE.value and "ID" in element.attributes:
            found.append(element.attributes["ID"])
    return found
