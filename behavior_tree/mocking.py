"""Mocks for node types that are known by their model only, or not at all."""

from collections.abc import Iterable, Mapping
from typing import Final

from .errors import RegistryError
from .node_registry import Registry
from .nodes.manifest import Direction, NodeKind, NodeManifest, PortModel
from .nodes.node import Node
from .substitution import MockAction, MockCondition, MockControl, MockDecorator
from .xml.collection import TreeCollection
from .xml.document import Element

_CLASSES: Final[Mapping[NodeKind, type[Node]]] = {
    NodeKind.ACTION: MockAction,
    NodeKind.CONDITION: MockCondition,
    NodeKind.DECORATOR: MockDecorator,
    NodeKind.CONTROL: MockControl,
}
_LONG_FORMS: Final = {kind.value: kind for kind in NodeKind}


def mock_models(registry: Registry, manifests: Iterable[NodeManifest]) -> tuple[str, ...]:
    """Register a mock for each node type that is not registered yet, and return their names.

    Actions succeed at once and conditions hold, decorators pass their child's result on, and control nodes are
    Sequences. Substitution rules make them do something else.
    """
    mocked = []
    for manifest in manifests:
        if manifest.kind is not NodeKind.SUBTREE and manifest.type_id not in registry.manifests:
            registry.register(_CLASSES[manifest.kind], manifest=manifest)
            mocked.append(manifest.type_id)
    return tuple(mocked)


def mock_outside(registry: Registry) -> tuple[str, ...]:
    """Mock the node types that may act on what is outside the tree, and return their names.

    These are the types that were registered with arguments, such as a robot; see `mock_models` for what mocks do.
    """
    outside = tuple(type_id for type_id in registry.manifests if registry.is_given_arguments(type_id))
    for type_id in outside:
        manifest = registry.manifests[type_id]
        registry.register(_CLASSES[manifest.kind], manifest=manifest, replace=True)
    return outside


def mock_unknown_types(registry: Registry, collection: TreeCollection) -> None:
    """Register mocks for all that a document uses and nobody knows: by its model, else as it is used.

    Raises:
        LoadError: A name cannot be that of a node type or of a port.
    """
    modelled = mock_models(registry, collection.node_models.values())
    used: dict[str, list[Element]] = {}
    for tree in collection.trees.values():
        pending = list(tree.children)
        while pending:
            element = pending.pop()
            pending.extend(reversed(element.children))
            type_id = element.attributes.get("ID", "") if element.tag in _LONG_FORMS else element.tag
            if type_id in collection.trees:
                continue  # A sub-tree, if wrongly written; the loader reports it.
            if element.tag != NodeKind.SUBTREE.value and type_id and type_id not in registry.manifests:
                used.setdefault(type_id, []).append(element)
            elif type_id in modelled and type_id not in used:
                collection.warnings.append(f"{element.place}: {type_id} is known by its model only and mocked")
                modelled = tuple(name for name in modelled if name != type_id)
    for type_id, elements in used.items():
        manifest = _as_used(type_id, elements)
        try:
            registry.register(_CLASSES[manifest.kind], manifest=manifest)
        except RegistryError as error:
            raise elements[0].error(error.message) from None
        kind = manifest.kind.value.lower()
        collection.warnings.append(f"{elements[0].place}: {type_id} is unknown and mocked as {kind}")


def _as_used(type_id: str, elements: list[Element]) -> NodeManifest:
    kinds = [_LONG_FORMS[element.tag] for element in elements if element.tag in _LONG_FORMS]
    most = max(len(element.children) for element in elements)
    guessed = (NodeKind.ACTION, NodeKind.DECORATOR, NodeKind.CONTROL)[min(most, 2)]
    names = (name for element in elements for name in element.attributes)
    ports = {
        name: PortModel(name, Direction.INOUT)
        for name in names
        if name not in ("name", "ID") and not name.startswith("_")
    }
    return NodeManifest(type_id, kinds[0] if kinds else guessed, ports)
