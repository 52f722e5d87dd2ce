"""The generated files are read in their published layouts; what is wrong is reported with file and line."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft.adaptation_manager.planners.metacontrol.skills.generators.writing import generated
from regraft.adaptation_manager.planners.metacontrol.skills.reading import LIBRARY, read_skills
from regraft.services.observers.observed_components import read_observed_components
from regraft.services.observers.observed_qualities import read_observed_qualities
from regraft.stack.yaml.problems import StackError
from tests.metacontrol.observers.scene import OBSERVED, written
from tests.metacontrol.skills.texts import checked

QUALITIES = """\
quality_observer:
  ros__parameters:
    qualities:
      safety: "laser.clearance / 3"
"""


def components(text: str, folder: Path) -> list[str]:
    """Return the components that a file with this text has."""
    return list(read_observed_components(Path(written(folder, text))))


def refused(text: str, folder: Path, *, of_qualities: bool = False) -> list[str]:
    """Return what is wrong with a file, each with its line."""
    read = read_observed_qualities if of_qualities else read_observed_components
    with pytest.raises(StackError) as error:
        read(Path(written(folder, text)))
    return [str(each).removeprefix(f"{folder}/") for each in error.value.problems]


@pytest.mark.parametrize(
    "value",
    [
        "\n      camera\n      laser",
        " camera laser",
        "\n    - camera\n    - laser",
        ' [camera, "laser"]',
        " |\n      camera\n      laser",
    ],
)
def test_names_are_one_scalar_or_a_list(value: str, tmp_path: Path) -> None:
    text = f"---\nmodes_observer:\n  ros__parameters:\n    components:{value}\n"
    assert components(text, tmp_path) == ["camera", "laser"]


def test_names_of_nodes_are_components_of_robots(tmp_path: Path) -> None:
    assert components(OBSERVED.replace("laser", "/rescuer/laser"), tmp_path) == ["camera", "rescuer.laser"]


def test_what_is_generated_is_read(tmp_path: Path) -> None:
    files = generated(read_skills(LIBRARY / "navigation.skills"))
    assert components(files["observed_components.yaml"], tmp_path) == ["laser_resender", "camera", "battery"]
    assert read_observed_qualities(Path(written(tmp_path, files["observed_qualities.yaml"]))) == {}
    text = 'Quality safety { measured: "laser.clearance / 3" }\nQuality y { measured: "a.b > 1 and \\"x\\" == c.d" }'
    measured = generated(checked(text).skills)["observed_qualities.yaml"]
    found = read_observed_qualities(Path(written(tmp_path, measured)))
    assert {name: expression.text for name, (expression, _) in found.items()} == {
        "safety": "laser.clearance / 3",
        "y": 'a.b > 1 and "x" == c.d',
    }
    assert components(generated(checked(text).skills)["observed_components.yaml"], tmp_path) == []


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "observed.yaml: is empty: must be a node with 'ros__parameters' and 'components'"),
        ("# nothing\n---\n", "observed.yaml: is empty: must be a node with 'ros__parameters' and 'components'"),
        ("- camera\n", "observed.yaml:1: is a list, must be one node with 'ros__parameters' and 'components'"),
        (
            OBSERVED + "other: 1\n",
            "observed.yaml:1: has 2 nodes, must be one node with 'ros__parameters' and 'components'",
        ),
        (
            OBSERVED.replace("ros__", "ros_"),
            "observed.yaml:2: modes_observer.ros_parameters: there is no such field; did you mean 'ros__parameters'?",
        ),
        (
            OBSERVED.replace("components", "componets"),
            "observed.yaml:3: modes_observer.ros__parameters.componets: there is no such field; "
            "did you mean 'components'?",
        ),
        (
            OBSERVED.replace("laser", "la$er"),
            "observed.yaml:3: modes_observer.ros__parameters.components: 'la$er' is no component's name: "
            "must be such as 'camera' or 'robot/camera'",
        ),
        (
            "a:\n  ros__parameters:\n    components:\n    - camera\n    - 5\n",
            "observed.yaml:5: a.ros__parameters.components: must be a name, is a number",
        ),
        (
            "a:\n  ros__parameters:\n    components:\n    - camera\n    - camera\n",
            "observed.yaml:5: a.ros__parameters.components: 'camera' is given twice, first in line 4",
        ),
        (
            "a:\n  ros__parameters:\n    components: 5\n",
            "observed.yaml:3: a.ros__parameters.components: must be names, as one text or a list, is a number",
        ),
        (
            "a:\n\tros__parameters:\n",
            "observed.yaml:2: is not YAML: a tab in the indentation (column 1): must be spaces",
        ),
        ("a: [" * 100, "observed.yaml: is nested too deeply: must have at most 32 levels"),
    ],
)
def test_what_is_wrong_is_reported_with_its_line(text: str, problem: str, tmp_path: Path) -> None:
    assert problem in refused(text, tmp_path)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (
            QUALITIES.replace('"laser.clearance / 3"', '"laser.clearance /"'),
            "observed.yaml:4: quality_observer.ros__parameters.qualities.safety: "
            "'laser.clearance /' is no expression: invalid syntax",
        ),
        (
            QUALITIES.replace('"laser.clearance / 3"', "0.5"),
            "observed.yaml:4: quality_observer.ros__parameters.qualities.safety: "
            "must be an expression in quotes, is a number",
        ),
        (
            QUALITIES.replace('"laser.clearance / 3"', '"1 / 3"'),
            "observed.yaml:4: quality_observer.ros__parameters.qualities.safety: "
            "'1 / 3' speaks of nothing that is measured: must be such as 'navigator.clearance'",
        ),
        (
            QUALITIES.replace("\n      safety", " safety"),
            "observed.yaml:3: is not YAML: mapping values are not allowed here (column 22)",
        ),
        (
            "a:\n  ros__parameters:\n    qualities: [a]\n",
            "observed.yaml:3: a.ros__parameters.qualities: must be a map of qualities, is a list",
        ),
    ],
)
def test_wrong_expressions_are_reported_with_their_line(text: str, problem: str, tmp_path: Path) -> None:
    assert refused(text, tmp_path, of_qualities=True) == [problem]


def test_files_and_lists_are_bounded(tmp_path: Path) -> None:
    assert "has more than 64 KiB" in refused("#" * 100_000, tmp_path)[0]
    names = " ".join(f"c{n}" for n in range(501))
    assert (
        "has 501 names, must have at most 500"
        in refused(f"a: {{ros__parameters: {{components: {names}}}}}", tmp_path)[0]
    )


def test_a_missing_file_is_reported_with_what_may_be_meant(tmp_path: Path) -> None:
    written(tmp_path)
    with pytest.raises(StackError, match=r"there is no such file; did you mean .*observed\.yaml"):
        read_observed_components(tmp_path / "observd.yaml")


@given(st.text(max_size=200))
def test_any_text_is_read_or_refused(text: str) -> None:
    with TemporaryDirectory() as folder:
        file = Path(folder) / "any.yaml"
        file.write_text(text, encoding="utf-8", errors="replace")
        for read in (read_observed_components, read_observed_qualities):
            try:
                read(file)
            except StackError:
                continue
