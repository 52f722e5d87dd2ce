"""Modules, classes and paths that do not exist are told with those that may be meant."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.process.main import NoSuchClass, load_class
from regraft.stack import StackError, load

STACK = """\
system: tests
clock: real
imports: [{imported}]
components:
  battery: {{class: '{path}'}}
"""


@pytest.mark.parametrize(
    ("path", "meant"),
    [
        ("regraft.services.navigatr.navigator:Navigator", "regraft.services.navigator.navigator"),
        ("regraft.services.navigator.navigatr:Navigator", "regraft.services.navigator.navigator"),
        ("services.battery:Battery", "regraft.services.battery"),
        ("regraft.services.battery:Batery", "Battery"),
    ],
)
def test_a_class_that_is_not_there(path: str, meant: str, tmp_path: Path) -> None:
    with pytest.raises(NoSuchClass, match=f"did you mean '{meant}'"):
        load_class(path)
    file = tmp_path / "stack.yaml"
    file.write_text(STACK.format(imported="regraft.bus_schema", path=path))
    with pytest.raises(StackError, match=f"stack.yaml:5: components.battery.class: .*did you mean '{meant}'"):
        load(file)


def test_a_module_of_the_stacks_folder_that_is_mistyped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "lantern_parts.py").write_text("")
    monkeypatch.syspath_prepend(str(tmp_path))
    file = tmp_path / "stack.yaml"
    file.write_text(STACK.format(imported="lantern_prts", path="regraft.services.battery:Battery"))
    with pytest.raises(StackError, match=r"imports.*did you mean 'lantern_parts'"):
        load(file)


def test_a_module_that_lacks_another_is_not_said_to_be_mistyped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "needs_another.py").write_text("import servces")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(NoSuchClass) as refused:
        load_class("needs_another:Class")
    assert "No module named 'servces'" in str(refused.value)
    assert "did you mean" not in str(refused.value)


@pytest.mark.parametrize("mistyped", ["regraft/stacks/frgo", "regraft/stcks/frog", "regraft/stacks/frog/serch.yaml"])
def test_a_stack_that_is_not_there(mistyped: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "regraft/stacks/frog").mkdir(parents=True)
    (tmp_path / "regraft/stacks/frog/search.yaml").write_text("")
    monkeypatch.chdir(tmp_path)
    meant = mistyped.replace("frgo", "frog").replace("stcks", "stacks").replace("serch", "search")
    with pytest.raises(StackError, match=f"{mistyped}: there is no such file; did you mean '{meant}'"):
        load(Path(mistyped))


def test_a_path_that_resembles_nothing_has_no_hint(tmp_path: Path) -> None:
    with pytest.raises(StackError) as refused:
        load(tmp_path / "x" / "y" / "z.yaml")
    assert str(refused.value).endswith("there is no such file")
