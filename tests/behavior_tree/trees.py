"""Short ways to make trees and to look at them."""

from xml.sax.saxutils import quoteattr

from behavior_tree import ManualClock, Registry, Tree, load_text
from behavior_tree.scripted import LETTERS, scripted_registry


def document(body: str, *others: str) -> str:
    """Return a document whose main tree M has a body; others are further elements of the root."""
    return (
        f'<root BTCPP_format="4" main_tree_to_execute="M"><BehaviorTree ID="M">{body}</BehaviorTree>'
        + "".join(others)
        + "</root>"
    )


def tree_of(body: str, *others: str, events: list[str] | None = None, clock: ManualClock | None = None) -> Tree:
    """Load a tree of built-in and scripted nodes, on a clock that stands still."""
    registry = scripted_registry(events if events is not None else [])
    return load_text(document(body, *others), registry, clock=clock or ManualClock())


def leaf(script: str, name: str = "leaf", **attributes: str) -> str:
    """Return the XML of a stateful action that returns the letters of a script one after the other."""
    more = "".join(f" {key}={quoteattr(value)}" for key, value in attributes.items())
    return f'<Scripted name="{name}" script="{script}"{more}/>'


def ticks(tree: Tree, count: int) -> str:
    """Tick a tree some times, exactly once each, and return the letters of the results."""
    return "".join(LETTERS[tree.tick_exactly_once()] for _ in range(count))


def statuses(tree: Tree) -> str:
    """Return the letters of all stored statuses in order of creation."""
    return "".join(LETTERS[node.status] for node in tree.nodes)


def plain_registry() -> Registry:
    """Return a registry with the built-in and the scripted nodes, where nobody looks at the events."""
    return scripted_registry([])
