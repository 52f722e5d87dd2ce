"""Gathers the trees of a document and of all documents that it includes."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from ..errors import LoadError
from ..manifest import NodeKind, NodeManifest, PortModel
from .document import Element, mended, parse_document
from .models import manifests_of

_TAGS: Final = ("include", "BehaviorTree", "TreeNodesModel")


@dataclass(slots=True)
class TreeCollection:
    """All trees that a document makes available.

    Attributes:
        trees: The ``<BehaviorTree>`` elements by ID; a tree without ID has the empty one.
        models: The ports of sub-trees that have a model, by tree ID and name.
        node_models: The node types that have a model, by ID; they need not be registered.
        document: The root element of the first document.
        unversioned: The files that do not say that they are of version 4.
        warnings: What is questionable but no error.
    """

    trees: dict[str, Element] = field(default_factory=dict)
    models: dict[str, dict[str, PortModel]] = field(default_factory=dict)
    node_models: dict[str, NodeManifest] = field(default_factory=dict)
    document: Element | None = None
    unversioned: set[str] = field(default_factory=set)
    warnings: list[str] = field(default_factory=list)

    def main_tree(self, wanted: str) -> str:
        """Return the ID of the tree to execute: the wanted one, the document's choice, or the only one.

        Raises:
            LoadError: There is no such tree, or no choice among several.
        """
        chosen = wanted or (self.document.attributes.get("main_tree_to_execute", "") if self.document else "")
        if chosen:
            if chosen not in self.trees:
                raise self._error(f"there is no tree '{chosen}'; there are {self._names()}")
            return chosen
        if len(self.trees) == 1:
            return next(iter(self.trees))
        raise self._error(f"set main_tree_to_execute, or name the tree to execute; there are {self._names()}")

    def _error(self, message: str) -> LoadError:
        return self.document.error(message) if self.document else LoadError(message)

    def _names(self) -> str:
        return ", ".join(f"'{name}'" for name in self.trees) or "none"


class Collector:
    """Reads documents into a TreeCollection."""

    def __init__(self, search_path: Sequence[Path], lenient: bool) -> None:
        """Look for packages below the folders of a search path; if lenient, accept ill-formed comments."""
        self.collection = TreeCollection()
        self._search_path = search_path
        self._lenient = lenient
        self._read: set[Path] = set()

    def add_file(self, path: Path) -> None:
        """Read a file, unless it has been read already.

        Raises:
            LoadError: The file cannot be read or is faulty.
        """
        path = path.resolve()
        if path in self._read:
            return
        self._read.add(path)
        try:
            text = path.read_text(encoding="utf-8-sig")
        except (OSError, UnicodeDecodeError) as error:
            raise LoadError(f"cannot read '{path}': {error}", file=str(path)) from error
        self.add_text(text, str(path), path.parent)

    def add_text(self, text: str, file: str, folder: Path) -> None:
        """Read a document's text; relative includes start from a folder.

        Raises:
            LoadError: The document is faulty.
        """
        root = self._parse(text, file)
        if root.tag != "root":
            raise root.error(f"the outermost element is <{root.tag}>; it must be <root>")
        version = root.attributes.get("BTCPP_format")
        if version != "4":
            wrong = 'BTCPP_format="4" is missing' if version is None else f"BTCPP_format is '{version}', not '4'"
            self.collection.unversioned.add(file)
            self.collection.warnings.append(f"{root.place}: {wrong}; read as version 4")
        for element in root.children:
            if element.tag not in _TAGS:
                self.collection.warnings.append(f"{element.place}: <{element.tag}> in <root> is ignored")
        if self.collection.document is None:
            self.collection.document = root
        for include in root.children_of("include"):
            self.add_file(self._included(include, folder))
        self._add_models(root)
        for tree in root.children_of("BehaviorTree"):
            self._add_tree(tree)

    def check_ids(self) -> None:
        """Check that every tree has an ID if there are several.

        Raises:
            LoadError: One has none.
        """
        unnamed = self.collection.trees.get("")
        if unnamed is not None and len(self.collection.trees) > 1:
            raise unnamed.error("<BehaviorTree> needs an ID, because there are several trees")

    def _parse(self, text: str, file: str) -> Element:
        try:
            return parse_document(text, file)
        except LoadError as error:
            if not self._lenient:
                raise
            self.collection.warnings.append(f"{error}; read leniently")
            return parse_document(mended(text), file)

    def _included(self, include: Element, folder: Path) -> Path:
        path = include.attributes.get("path", "")
        if not path:
            raise include.error("<include> needs a path")
        package = include.attributes.get("ros_pkg")
        if package is None or Path(path).is_absolute():
            return self._existing(include, [folder / path])
        return self._existing(include, [root / package / path for root in self._search_path])

    def _existing(self, include: Element, candidates: list[Path]) -> Path:
        for candidate in candidates:
            if candidate.is_file():
                return candidate
        tried = ", ".join(str(candidate) for candidate in candidates) or "no folder: the search path is empty"
        raise include.error(f"included file not found; tried {tried}")

    def _add_models(self, root: Element) -> None:
        models = root.children_of("TreeNodesModel")
        if len(models) > 1:
            raise models[1].error("only one <TreeNodesModel> is allowed")
        for model in models:
            for manifest in manifests_of(model):
                if manifest.kind is NodeKind.SUBTREE:
                    self.collection.models[manifest.type_id] = dict(manifest.ports)
                else:
                    self.collection.node_models.setdefault(manifest.type_id, manifest)

    def _add_tree(self, tree: Element) -> None:
        tree_id = tree.attributes.get("ID", "")
        other = self.collection.trees.get(tree_id)
        if other is not None:
            named = f"two trees have the ID '{tree_id}'" if tree_id else "two trees are without ID"
            raise tree.error(f"{named}; the other is at {other.place}")
        self.collection.trees[tree_id] = tree
