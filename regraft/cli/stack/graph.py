"""Writes components and topics as a graph in Graphviz's language."""

from __future__ import annotations

from collections.abc import Iterator

from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.lifecycle import State


def dot(architecture: Architecture) -> str:
    """Return the graph: components are boxes, topics ellipses, and each robot has a frame around its own."""
    return "\n".join(_lines(architecture))


def _lines(architecture: Architecture) -> Iterator[str]:
    yield f"digraph {_quoted(architecture.system)} {{"
    yield "  rankdir=LR;"
    yield "  node [fontname=Helvetica, fontsize=10];"
    scopes = [name.rpartition(".")[0] for name in architecture.components]
    for number, scope in enumerate(dict.fromkeys(scopes)):
        own = [spec for name, spec in architecture.components.items() if name.rpartition(".")[0] == scope]
        topics = [name for name in architecture.topics if _scope_of_topic(name, scopes) == scope]
        nodes = [*map(_component, own), *(_topic(name, architecture) for name in topics)]
        if not scope:
            yield from (f"  {node}" for node in nodes)
            continue
        yield f"  subgraph cluster_{number} {{"
        yield f"    label={_quoted(scope)};"
        yield from (f"    {node}" for node in nodes)
        yield "  }"
    if "" not in scopes:
        yield from (
            f"  {_topic(name, architecture)}" for name in architecture.topics if not _scope_of_topic(name, scopes)
        )
    for name in architecture.topics:
        yield from (_edge(f"component {writer}", f"topic {name}", port) for writer, port in architecture.writers(name))
        yield from (_edge(f"topic {name}", f"component {reader}", port) for reader, port in architecture.readers(name))
    yield "}"


def _scope_of_topic(name: str, scopes: list[str]) -> str:
    scope, slash, _ = name.partition("/")
    return scope if slash and scope in scopes else ""


def _component(spec: ComponentSpec) -> str:
    dashed = "" if spec.state is State.ACTIVE else ", style=dashed"
    what = spec.cls.rpartition(":")[2] if spec.cls else " ".join(spec.command)
    label = f"{spec.name}\n{what}"
    return f"{_quoted(f'component {spec.name}')} [shape=box, label={_quoted(label)}{dashed}];"


def _topic(name: str, architecture: Architecture) -> str:
    label = f"{name}\n{architecture.topics[name].type}"
    return f"{_quoted(f'topic {name}')} [shape=ellipse, label={_quoted(label)}];"


def _edge(start: str, end: str, port: str) -> str:
    return f"  {_quoted(start)} -> {_quoted(end)} [tooltip={_quoted(port)}];"


def _quoted(text: str) -> str:
    """Return a text as the language has it.

    >>> _quoted('a "b"')
    '"a \\\\"b\\\\""'
    """
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n") + '"'
