"""FROG's stacks hold together, before and after what their missions change in them."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from typing import Any

import pytest

from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.consistency import violations
from regraft.bus_schema.model.lifecycle import State
from regraft.stack import load
from tests.missions.robot import MISSIONS, STACKS

AFTER = {"activate": State.ACTIVE, "deactivate": State.INACTIVE}
TRUTH = {"ground_truth", "truth/map", "truth/goals"}


def architecture(name: str) -> Architecture:
    return load(STACKS / f"{name}.yaml").architecture


def adaptations(mission: str) -> list[list[dict[str, Any]]]:
    """Return the changes of each Adapt leaf of a mission, in the order of the file."""
    leaves = ElementTree.parse(MISSIONS / f"{mission}.xml").iter("Adapt")
    return [json.loads(leaf.attrib["changes"].removeprefix("json:")) for leaf in leaves]


def changed(before: Architecture, changes: list[dict[str, Any]]) -> Architecture:
    """Return an architecture as connections and transitions leave it."""
    components = dict(before.components)
    for change in changes:
        spec = components[change["component"]]
        if change["change"] == "connect":
            assert change["port"] in spec.connections, change
            spec = replace(spec, connections={**spec.connections, change["port"]: change["topic"]})
        else:
            spec = replace(spec, state=AFTER[change["transition"]])
        components[change["component"]] = spec
    return replace(before, components=components)


@pytest.mark.parametrize("name", ["stack", "explore", "search", "rounds"])
def test_the_stack_is_consistent(name: str) -> None:
    assert violations(architecture(name)) == ()


def test_what_the_search_changes_leaves_a_consistent_system_at_every_step() -> None:
    now = architecture("search")
    steps = adaptations("searching")
    assert len(steps) == 2
    for changes in steps:
        now = changed(now, changes)
        assert violations(now) == ()
    active = {name for name, spec in now.components.items() if spec.state is State.ACTIVE}
    assert {"localizer", "obstacles", "detector", "navigator"} <= active
    assert not {"mapper", "explorer"} & active


def test_after_the_search_s_changes_no_one_but_the_evaluation_reads_what_the_mapper_wrote() -> None:
    now = architecture("search")
    for changes in adaptations("searching"):
        now = changed(now, changes)
    readers = {
        name
        for name, spec in now.components.items()
        for port, topic in spec.connections.items()
        if topic in {"map", "localization"}
        and spec.state is State.ACTIVE
        and not spec.cls.startswith("regraft.evaluation.")
    }
    assert readers == {"localizer"}


@pytest.mark.parametrize("name", ["stack", "explore", "search", "rounds"])
def test_only_the_evaluation_and_the_world_itself_know_the_truth(name: str) -> None:
    for component, spec in architecture(name).components.items():
        if TRUTH & set(spec.connections.values()):
            assert spec.cls.split(".")[1] in {"evaluation", "sim_service"}, component


def test_the_detector_rests_until_it_is_needed() -> None:
    assert architecture("search").components["detector"].state is State.INACTIVE
