"""FROG's stack files: who may read the truth, and which classes may stand in for each other."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.consistency import violations
from regraft.bus_schema.model.description import Description
from regraft.host.plan import HostPlan
from regraft.stack import check_with_classes, load
from tests.support.paths import FROG

pytestmark = pytest.mark.slow

STACKS = sorted(path for path in FROG.glob("*.yaml") if path.stem != "base")
TRUTH = ("ground_truth", "truth/")
ALTERNATIVES = {
    "mapper": ("regraft.services.mapper.mapper:Mapper", "regraft.services.mapper.odometry_mapper:OdometryMapper"),
    "navigator": (
        "regraft.services.navigator.navigator:Navigator",
        "regraft.services.navigator.pursuit_navigator:PursuitNavigator",
    ),
    "detector": (
        "regraft.services.detector.detector:Detector",
        "regraft.services.detector.template_detector:TemplateDetector",
    ),
}


@pytest.mark.parametrize("file", STACKS, ids=lambda file: file.stem)
def test_nobody_but_the_evaluation_reads_the_truth(file: Path) -> None:
    architecture = load(file).architecture
    topics = [topic for topic in architecture.topics if topic.startswith(TRUTH)]
    readers = {component for topic in topics for component, _ in architecture.readers(topic)}
    assert "ground_truth" in topics
    assert readers
    assert {architecture.components[name].cls.split(".")[1] for name in readers} == {"evaluation"}


@pytest.mark.parametrize("file", STACKS, ids=lambda file: file.stem)
@pytest.mark.parametrize("component", ALTERNATIVES)
def test_another_class_stands_in_by_one_word_in_the_stack_file(file: Path, component: str, tmp_path: Path) -> None:
    before = load(file).architecture.components.get(component)
    if before is None or before.cls not in ALTERNATIVES[component]:
        return
    (other,) = set(ALTERNATIVES[component]) - {before.cls}
    swapped = tmp_path / "swapped.yaml"
    swapped.write_text(f"include: [{file}]\ncomponents:\n  {component}: {{class: '{other}'}}\n")
    architecture = load(swapped).architecture
    assert architecture.components[component].cls == other
    assert interface(architecture.components[component].description) == interface(before.description)


@pytest.mark.parametrize("file", STACKS, ids=lambda file: file.stem)
def test_the_order_of_the_components_decides_nothing_of_a_run(file: Path) -> None:
    """The files that a stack includes may order components as they like: a run goes by their names."""
    architecture = load(file).architecture
    turned = replace(architecture, components=dict(reversed(architecture.components.items())))
    first, second = plan_of(architecture), plan_of(turned)
    assert first.members() == second.members()
    assert first.sensor_streams() == second.sensor_streams()
    assert violations(architecture) == violations(turned) == ()


def test_a_visitor_walks_in_the_world_of_every_component_that_has_one() -> None:
    stack = load(FROG / "visitor.yaml")
    check_with_classes(stack)
    files = [spec.parameters["file"] for spec in stack.architecture.components.values() if "file" in spec.parameters]
    assert len(files) >= 3
    assert set(files) == {str(FROG / "world_with_visitor.xml")}


def plan_of(architecture: Architecture) -> HostPlan:
    nowhere = Path("/")
    return HostPlan(
        architecture=architecture,
        folder=nowhere,
        stack_folder=nowhere,
        run="1",
        endpoint="",
        secret="",
        source="world",
    )


def interface(description: Description | None) -> object:
    """Return what others see of a class: its ports and services."""
    assert description is not None
    ports = {(port.name, port.direction, port.type, port.required) for port in description.ports}
    return ports, {(service.name, service.request, service.reply) for service in description.services}
