"""Reads the topic table of a stack file."""

from __future__ import annotations

from regraft.bus_schema.encoding.topic_types import instead_of_type, is_type
from regraft.bus_schema.model.architecture import TopicSpec, Writers
from regraft.stack.yaml.section import Section


def read_topics(table: Section) -> dict[str, TopicSpec]:
    """Return all topics by name; ``scan: regraft/LaserScan`` is short for ``scan: {type: ...}``."""
    topics = {}
    for name in table.names():
        topic = _short_topic(table, name) or _topic(table, name)
        if topic:
            topics[name] = topic
    return topics


def check_type(section: Section, key: str, name: str) -> bool:
    """Note it if no message type of that name is known here; return whether one is."""
    if is_type(name):
        return True
    section.wrong(key, f"no message type {name!r} is known here; {instead_of_type(name)}")
    return False


def _short_topic(table: Section, name: str) -> TopicSpec | None:
    node = table.node(name)
    if node is None or not isinstance(node.value, str) or not check_type(table, name, node.value):
        return None
    return TopicSpec(name, node.value)


def _topic(table: Section, name: str) -> TopicSpec | None:
    node = table.node(name)
    if node is None or isinstance(node.value, str):
        return None
    section = table.section(name)
    section.only("type", "rate", "sensor_stream", "writers")
    reliable = not section.flag("sensor_stream", False)
    rate = section.number("rate", minimum=0.0)
    writers = section.choice("writers", Writers, Writers.ONE)
    kind = section.text("type")
    if "type" not in section:
        section.report.add(section.path, "has no 'type': must name the message type that it carries")
    if not kind or not check_type(section, "type", kind):
        return None
    return TopicSpec(name, kind, reliable, rate, writers)
