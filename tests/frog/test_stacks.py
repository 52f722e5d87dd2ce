"""FROG's stack files: who may read the truth, and which classes may stand in for each other."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.bus_schema.model.description import Description
from regraft.stack import load
from tests.support.paths import FROG

STACKS = sorted(Path(FROG).glob("*.yaml"))
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
    text = file.read_text()
    used = [cls for cls in ALTERNATIVES[component] if f"class: {cls}" in text]
    for cls in used:
        (other,) = set(ALTERNATIVES[component]) - {cls}
        swapped = tmp_path / "swapped.yaml"
        swapped.write_text(text.replace(f"class: {cls}", f"class: {other}"))
        for part in file.parent.iterdir():
            if part.suffix != ".yaml":
                (tmp_path / part.name).symlink_to(part)
        architecture = load(swapped).architecture
        assert architecture.components[component].cls == other
        assert interface(architecture.components[component].description) == interface(
            load(file).architecture.components[component].description
        )


def interface(description: Description | None) -> object:
    """Return what others see of a class: its ports and services."""
    assert description is not None
    ports = {(port.name, port.direction, port.type, port.required) for port in description.ports}
    return ports, {(service.name, service.request, service.reply) for service in description.services}
