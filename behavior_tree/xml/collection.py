"""Gathers the trees of a document and of all documents that it includes."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from ..errors import LoadError
from ..nodes.limits import Limits
from ..nodes.manifest import NodeKind, NodeManifest, PortModel
from .document import Element, parse_document, parse_leniently
from .encoding import decode
from .models import manifests_of

MAX_INCLUDE: Final = 100
_MAX_BYTES: Final = 4
"""The most bytes of one character."""
_TAGS: Final = ("include", "BehaviorTree", "TreeNodesModel")


@dataclass(slots=True)
class TreeCollection:
    """All trees that a document makes available.

    Attributes:
        trees: The ``<BehaviorTree>`` elements by ID; a tree without ID has the empty one.
        models: The ports of sub-trees that have a model, by tree ID and name.
        node_models: The node types that have a model, by ID; they need not be registered.
        document: The root element of the first document.
        unversioned: The files that do not state that they are of version 4.
        warnings: Doubts that are no errors.
    """

    trees: dict[str, Element] = field(default_factory=dict)
    models: dict[str, dict[str, PortModel]] = field(default_factory=dict)
    node_models: dict[str, NodeManifest] = field(default_factory=dict)
    document: Element | None = None
    unversioned: set[str] = field(default_factory=set)
    warnings: list[str] = field(default_factory=list)

    def include(self, other: "TreeCollection", tree_id: str) -> None:
        """Take over what another collection knows for one of its trees: models, and doubts about its file."""
        if tree_id in other.models:
            self.models.setdefault(tree_id, other.models[tree_id])
        for type_id, manifest in other.node_models.items():
            self.node_models.setdefault(type_id, manifest)
        self.unversioned |= other.unversioned
        self.warnings += [warning for warning in other.warnings if warning not in self.warnings]

    @property
    def named_main(self) -> str:
        """The ID of the tree to execute that the first document names, empty if it names none."""
        return self.document.attributes.get("main_tree_to_execute", "") if self.document else ""

    def main_tree(self, wanted: str) -> str:
        """Return the ID of the tree to execute: the wanted one, the document's choice, or the only one.

        Raises:
            LoadError: There is no such tree, or no choice among several.
        """
        chosen = wanted or self.named_main
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

    def __init__(self, search_path: Sequence[Path], lenient: bool, limits: Limits | None = None) -> None:
        """Look for packages below the folders of a search path; if lenient, accept ill-formed comments."""
        self.collection = TreeCollection()
        self._search_path = search_path
        self._lenient = lenient
        self._limits = limits
        self._read: set[Path] = set()
        self._length = 0
        self._depth = 0

    @property
    def length(self) -> int:
        """The characters read so far."""
        return self._length

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
            if path.exists() and not path.is_file():
                raise LoadError(f"cannot read '{path}': it is no file", file=str(path))
            self._check_size(path)
            text = decode(path.read_bytes())
        except (OSError, ValueError) as error:
            raise LoadError(f"cannot read '{path}': {error}", file=str(path)) from error
        self._count(len(text), str(path))
        self.add_text(text, str(path), path.parent)

    def add_own_text(self, text: str, folder: Path) -> None:
        """Read text that comes from no file; see `add_text`."""
        self._count(len(text), "")
        self.add_text(text, "", folder)

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
            if self._depth >= MAX_INCLUDE:
                raise include.error(f"files are included through more than {MAX_INCLUDE} others")
            self._depth += 1
            self.add_file(self._included(include, folder))
            self._depth -= 1
        self._add_models(root)
        for tree in root.children_of("BehaviorTree"):
            self._add_tree(tree)

    def _count(self, length: int, file: str) -> None:
        """Make sure that it is soon read; raises LoadError."""
        self._length += length
        if self._limits:
            self._limits.check_xml(self._length, file)

    def _check_size(self, path: Path) -> None:
        """Make sure, before it is read, that a file is not too large in any encoding; raises LoadError."""
        if self._limits:
            self._limits.check_xml(self._length + path.stat().st_size // _MAX_BYTES, str(path))

    def check_ids(self) -> None:
        """Check that every tree has an ID if there are several.

        Raises:
            LoadError: One has none.
        """
        unnamed = self.collection.trees.get("")
        if unnamed is not None and len(self.collection.trees) > 1:
            raise unnamed.error("<BehaviorTree> needs an ID, because there are several trees")

    def _parse(self, text: str, file: str) -> Element:
        if not self._lenient:
            return parse_document(text, file)
        root, wrong = parse_leniently(text, file)
        if wrong:
            self.collection.warnings.append(wrong)
        return root

    def _included(self, include: Element, folder: Path) -> Path:
        path = include.attributes.get("path", "")
        if not path:
            raise include.error("<include> needs a path")
        package, folder = include.attributes.get("ros_pkg"), folder.resolve()
        if package is None or Path(path).is_absolute():
            return self._existing(include, [folder / path])
        roots = [root / package for root in self._search_path]
        roots += [above for above in (folder, *folder.parents) if above.name == package]
        return self._existing(include, [root / path for root in roots])

    def _existing(self, include: Element, candidates: list[Path]) -> Path:
        for candidate in candidates:
            try:
                if candidate.is_file():
                    return candidate
            except OSError as error:
                raise include.error(f"included file cannot be read: {error.strerror}: {str(candidate)[:200]}") from None
        tried = ", ".join(str(candidate) for candidate in candidates) or "no folder: none above has the package's name"
        raise include.error(f"included file not found; tried {tried}")

    def _add_models(self, root: Element) -> None:
        models = root.children_of("TreeNodesModel")
        if len(models) > 1:
            raise models[1].error("only one <TreeNodesModel> is allowed")
        for model in models:
            for manifest in manifests_of(model, self.collection.warnings):
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
