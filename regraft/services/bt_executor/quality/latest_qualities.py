"""The latest of every quality requirement of a mission."""

from __future__ import annotations

from behavior_tree import Tree
from regraft.bus_schema.messages.quality import Quality
from regraft.services.bt_executor.quality.naming import bus_names
from regraft.services.bt_executor.quality.requirement_node import QualityRequirement


class LatestQualities:
    """The latest verdict on each requirement; one whose child is done, or was halted, is there but not active."""

    def __init__(self) -> None:
        self._places: dict[str, int] = {}
        self._latest: dict[str, Quality] = {}

    def follow(self, tree: Tree) -> None:
        """Forget what was, and give each requirement of a tree its name on the bus."""
        requirements = [node for node in tree.nodes if isinstance(node, QualityRequirement)]
        names = bus_names([(node.name, node.path) for node in requirements])
        for node, name in zip(requirements, names, strict=True):
            node.bus_name = name
        self._places = {name: place for place, name in enumerate(names)}
        self._latest = {}

    def write(self, quality: Quality) -> None:
        """Keep the latest of a requirement."""
        self._latest[quality.requirement] = quality

    def current(self) -> tuple[Quality, ...]:
        """Return the latest report of each requirement that has one, in the tree's order."""
        last = len(self._places)
        return tuple(sorted(self._latest.values(), key=lambda quality: self._places.get(quality.requirement, last)))

    def latest(self, requirement: str) -> Quality | None:
        """Return the latest report of a requirement by its name on the bus, None if there is none."""
        return self._latest.get(requirement)
