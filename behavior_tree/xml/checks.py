"""Checks the structure of all trees before any node is made."""

from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from typing import Final

from ..nodes.limits import Size
from ..nodes.manifest import NodeKind, NodeManifest
from .collection import TreeCollection
from .document import Element

_VERSION_3: Final = {
    "SequenceStar": "; version 4 calls it SequenceWithMemory",
    "FallbackStar": "; version 4 has no such node",
    "SubTreePlus": "; version 4 calls it SubTree",
    "RetryUntilSuccesful": "; version 4 spells it RetryUntilSuccessful",
    "ManualSelector": "; version 4 has no such node among the built-in ones",
    **{
        f"BlackboardCheck{kind}": "; version 4 has attributes such as _skipIf and the node Precondition instead"
        for kind in ("Int", "Double", "String", "Bool")
    },
}
_UNVERSIONED: Final = '; the file lacks BTCPP_format="4": is it a tree of version 3?'
MAX_LEVELS: Final = 2_000
"""Levels of nodes, sub-trees counted: a tick takes some frames of Python's stack at each."""
LONG_FORMS: Final = tuple(kind.value for kind in NodeKind)


def type_of(element: Element) -> str:
    """Return the node type of an element: its tag, or the ID in the long form.

    Raises:
        LoadError: The long form is without ID, or the short form has one.
    """
    type_id = element.attributes.get("ID")
    if element.tag in LONG_FORMS:
        if not type_id:
            raise element.error(f"<{element.tag}> needs an ID")
        return "SubTree" if element.tag == "SubTree" else type_id
    if type_id is not None:
        raise element.error(f"<{element.tag}> must not have an ID; use the attribute name")
    return element.tag


def check_structure(collection: TreeCollection, manifests: Mapping[str, NodeManifest]) -> None:
    """Check the node types and numbers of children of all trees, also of those that are not executed.

    Raises:
        LoadError: Something is wrong; the error names the place.
    """
    for tree_id, tree in collection.trees.items():
        if tree_id in manifests:
            raise tree.error(f"the tree ID '{tree_id}' is the name of a node type")
        if len(tree.children) != 1:
            raise tree.error(f"<BehaviorTree> needs exactly 1 child, it has {len(tree.children)}")
        pending = list(tree.children)
        while pending:
            element = pending.pop()
            _check_element(element, collection, manifests)
            pending.extend(reversed(element.children))


def total_size(collection: TreeCollection, main: str, longest: int | None = None) -> Size:
    """Return how large a tree is with its sub-trees, without making any node.

    Args:
        collection: All trees.
        main: The tree.
        longest: The most characters of one attribute, None for any number.

    Raises:
        LoadError: A tree contains itself, is nested deeper than `MAX_LEVELS`, or an attribute is too long.
    """
    return _Sizes(collection, longest).of_tree(main)


class _Sizes:
    """Measures each tree once, those that a tree uses before it."""

    def __init__(self, collection: TreeCollection, longest: int | None) -> None:
        self._collection = collection
        self._longest = longest
        self._known: dict[str, Size] = {}

    def of_tree(self, main: str) -> Size:
        # Sub-trees may be nested more deeply than Python lets functions call each other.
        open_trees = {main: iter(self._uses(main))}
        while open_trees:
            tree_id, uses = next(reversed(open_trees.items()))
            element = next(uses, None)
            if element is None:
                del open_trees[tree_id]
                self._known[tree_id] = self._measured(self._root(tree_id))
                continue
            used = element.attributes["ID"]
            if used in open_trees:
                outer = list(open_trees)
                circle = " → ".join([*outer[outer.index(used) :], used])
                raise element.error(f"a tree cannot contain itself: {circle}")
            if used not in self._known:
                open_trees[used] = iter(self._uses(used))
        return self._known[main]

    def _root(self, tree_id: str) -> Element:
        return self._collection.trees[tree_id].children[0]

    def _uses(self, tree_id: str) -> list[Element]:
        return [element for element, _ in _with_levels(self._root(tree_id)) if element.tag == "SubTree"]

    def _measured(self, root: Element) -> Size:
        deepest = nodes = characters = 0
        for element, level in _with_levels(root):
            nodes += 1
            characters += self._characters(element)
            if element.tag == "SubTree":
                inside = self._known[element.attributes["ID"]]
                level += inside.depth
                nodes += inside.nodes
                characters += inside.characters
            if level > MAX_LEVELS:
                raise element.error(f"the tree has more than {MAX_LEVELS} levels of nodes, those of sub-trees counted")
            deepest = max(deepest, level)
        return Size(deepest, nodes, characters)

    def _characters(self, element: Element) -> int:
        for name, text in element.attributes.items():
            if self._longest is not None and len(text) > self._longest:
                type_id = type_of(element)
                raise element.error(f"{type_id}'s {name[:40]} has {len(text)} characters: at most {self._longest}")
        return sum(map(len, element.attributes.values()))


def _with_levels(root: Element) -> Iterator[tuple[Element, int]]:
    """Yield an element and all inside, in the order of the document, each with its level from 1."""
    pending = [(root, 1)]
    while pending:
        element, level = pending.pop()
        yield element, level
        pending.extend((child, level + 1) for child in reversed(element.children))


def _nearest(type_id: str, manifests: Mapping[str, NodeManifest]) -> str:
    near = get_close_matches(type_id[:200], manifests, n=1)
    return f"; did you mean '{near[0]}'?" if near else ""


def _check_element(element: Element, collection: TreeCollection, manifests: Mapping[str, NodeManifest]) -> None:
    type_id = type_of(element)
    manifest = manifests.get(type_id)
    if manifest is None:
        if type_id in collection.trees:
            hint = f'; the tree of this name is used by <SubTree ID="{type_id}"/>'
        else:
            unversioned = _UNVERSIONED if element.file in collection.unversioned else ""
            hint = _VERSION_3.get(type_id) or _nearest(type_id, manifests) or unversioned
        raise element.unknown_type(type_id, hint)
    count = len(element.children)
    if manifest.kind is NodeKind.SUBTREE:
        if count:
            raise element.error("<SubTree> takes no children")
        if element.attributes["ID"] not in collection.trees:
            raise element.error(f"there is no tree '{element.attributes['ID']}'")
    elif manifest.kind is NodeKind.DECORATOR and count != 1:
        raise element.error(f"decorator {type_id} needs exactly 1 child, it has {count}")
    elif manifest.kind is NodeKind.CONTROL and not count:
        raise element.error(f"control node {type_id} needs at least 1 child")
    elif manifest.kind in (NodeKind.ACTION, NodeKind.CONDITION) and count:
        raise element.error(f"{manifest.kind.value.lower()} {type_id} takes no children, it has {count}")
    if type_id == "ReactiveSequence":
        _check_reactive_sequence(element)


def _check_reactive_sequence(element: Element) -> None:
    asynchronous = [child for child in element.children if type_of(child) == "AsyncSequence"]
    if len(asynchronous) > 1:
        raise asynchronous[1].error("ReactiveSequence takes only one AsyncSequence as a child")
