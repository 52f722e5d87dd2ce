"""What the tests of quality requirements share: trees on a clock that the test moves."""

from __future__ import annotations

from typing import Any

from behavior_tree import (
    FAILURE,
    RUNNING,
    SKIPPED,
    SUCCESS,
    Input,
    ManualClock,
    Node,
    NodeSetup,
    Registry,
    StatefulAction,
    Status,
    Tree,
    load_text,
)
from regraft.bus_schema.messages.quality import Quality
from regraft.services.bt_executor.quality import LatestQualities, PlainSystemQR, PlainTaskQR

RESULTS = {"R": RUNNING, "S": SUCCESS, "F": FAILURE, "K": SKIPPED}
LETTERS = "IRSFK"


class Spelt(StatefulAction):
    """Returns the letters of its script one after the other, over and over; counts its ticks, halts and starts."""

    script = Input(str, default="R")

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self.ticks = 0
        self.starts = 0
        self.halts = 0

    def on_start(self) -> Status:
        """Begin."""
        self.starts += 1
        return self.on_running()

    def on_running(self) -> Status:
        """Give the next letter."""
        letter = self.script[self.ticks % len(self.script)]
        self.ticks += 1
        if letter == "!":
            raise RuntimeError("the leaf broke")
        return RESULTS[letter]

    def on_halted(self) -> None:
        """Count."""
        self.halts += 1


class Ear:
    """Hears what requirements tell, and keeps the book."""

    def __init__(self) -> None:
        self.heard: list[Quality] = []
        self.book = LatestQualities()

    def report_quality(self, quality: Quality) -> None:
        """Hear it."""
        self.heard.append(quality)
        self.book.write(quality)


class Field:
    """A tree, its clock, and who hears of its qualities."""

    def __init__(self, body: str, *classes: type[Node], others: str = "", board: dict[str, Any] | None = None) -> None:
        """Load a tree M with a body; ``others`` are further trees."""
        self.clock = ManualClock()
        self.ear = Ear()
        registry = Registry()
        registry.register(Spelt)
        registry.register(PlainTaskQR, "TaskLevelQR", context=self.ear)
        registry.register(PlainSystemQR, "SystemLevelQR", context=self.ear)
        for node_class in classes:
            registry.register(node_class, context=self.ear)
        main = f'<BehaviorTree ID="M">\n{body}</BehaviorTree>'
        text = f'<root BTCPP_format="4" main_tree_to_execute="M">{others}{main}</root>'
        self.tree: Tree = load_text(text, registry, clock=self.clock)
        self.ear.book.follow(self.tree)
        for key, value in (board or {}).items():
            self.put(key, value)

    def put(self, key: str, value: Any) -> None:
        """Write an entry of the root board."""
        self.tree.blackboard.set(key, value)

    def get(self, key: str) -> Any:
        """Return what an entry of the root board holds, None if it is empty."""
        entry = self.tree.blackboard.find(key)
        return entry.value if entry else None

    def tick(self, seconds: float = 0.0) -> str:
        """Move the clock, tick once, and return the letter of the result."""
        self.clock.advance(seconds)
        return LETTERS[self.tree.tick_exactly_once()]

    def quality(self, name: str) -> Quality:
        """Return the latest of a requirement."""
        latest = self.ear.book.latest(name)
        assert latest is not None, f"nothing was told of {name}"
        return latest

    def leaf(self, name: str = "leaf") -> Spelt:
        """Return a leaf of the tree."""
        (found,) = [node for node in self.tree.nodes if node.name == name]
        assert isinstance(found, Spelt)
        return found


def task(child: str = "<Spelt name='leaf'/>", name: str = "QR", **ports: str) -> str:
    """Return the XML of a task-level requirement."""
    return _decorated("TaskLevelQR", child, name, {"quality_attribute": "Safety", **ports})


def system(child: str, name: str = "SYS", **ports: str) -> str:
    """Return the XML of a system-level requirement."""
    return _decorated("SystemLevelQR", child, name, {"quality_attribute": "Safety", **ports})


def _decorated(tag: str, child: str, name: str, ports: dict[str, str]) -> str:
    given = " ".join(f'{port}="{value}"' for port, value in ports.items())
    return f'<{tag} name="{name}" {given}>{child}</{tag}>'
