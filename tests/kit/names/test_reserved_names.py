"""A class that uses a name of the component base for something else is refused where it is defined."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.process.main import NoSuchClass, load_class
from regraft.testing import Rig
from tests.stack.reading.files import problems

HEAD = """\
from regraft.bus_schema.messages.geometry import Twist
from regraft import Component, Input, Output, Parameter, every, service


class Odd(Component):
    "Is odd."

"""
LINE = HEAD.count("\n") + 1

WRONG = {
    "    kit = 3\n": ("'kit' cannot name an attribute", 0),
    "    kit = Parameter(1.0)\n": ("'kit' cannot name a parameter", 0),
    "    kit: int = 3\n": ("'kit' cannot name an attribute", 0),
    "    def kit(self): ...\n": ("'kit' cannot name an attribute", 0),
    "    gain = Parameter(1.0)\n    snapshot = Input(Twist)\n": ("'snapshot' cannot name a port", 1),
    "    restore = Output(Twist)\n": ("'restore' cannot name a port", 0),
    "    resources = Parameter('a')\n": ("'resources' cannot name a parameter", 0),
    "    on_activate = 1\n": ("'on_activate' cannot name a value", 0),
    "    def exclusive(self): ...\n": ("'exclusive' cannot name a method", 0),
    "    @property\n    def state_version(self): return 1\n": ("'state_version' cannot name a method", 1),
    "    @every(hz=1)\n    def evaluate(self): ...\n": ("'evaluate' cannot name a service, action or timer", 1),
    "    def on_configure(self):\n        x = 1\n        self.kit = x\n": (
        "'kit' cannot name an attribute in Odd.on_configure",
        2,
    ),
    "    async def look(this, kit):\n        this.kit = kit\n": ("'kit' cannot name an attribute in Odd.look", 1),
    "    def on_configure(self):\n        self.kit = 1\n        self.a = lambda: self\n": (
        "'kit' cannot name an attribute in Odd.on_configure",
        1,
    ),
    "    def on_configure(self):\n        self.resources, self.a = 1, 2\n": (
        "'resources' cannot name an attribute in Odd.on_configure",
        1,
    ),
}


def module(folder: Path, monkeypatch: pytest.MonkeyPatch, text: str) -> Path:
    """Write a module of a name of its own; it can be imported."""
    file = folder / f"odd_{folder.name}.py"
    file.write_text(HEAD + text)
    monkeypatch.syspath_prepend(str(folder))
    return file


@pytest.mark.parametrize("text", WRONG, ids=lambda text: text.strip().splitlines()[-1])
def test_a_name_of_the_base_is_refused_with_file_and_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str
) -> None:
    file = module(tmp_path, monkeypatch, text)
    why, after = WRONG[text]
    with pytest.raises(NoSuchClass) as refused:
        load_class(f"{file.stem}:Odd")
    assert f"{file}:{LINE + after}: {why}" in str(refused.value)
    assert str(refused.value).endswith("choose another name")


@pytest.mark.parametrize(
    "hook", ["async def on_activate(self):", "async def restore(self, state):", "async def snapshot(self):"]
)
def test_a_hook_that_nobody_would_await_is_refused_with_file_and_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, hook: str
) -> None:
    file = module(tmp_path, monkeypatch, f"    {hook}\n        pass\n")
    name = hook.split("(")[0].removeprefix("async def ")
    with pytest.raises(NoSuchClass) as refused:
        load_class(f"{file.stem}:Odd")
    assert f"{file}:{LINE}: '{name}' cannot be async" in str(refused.value)


def test_a_stack_with_such_a_class_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = module(tmp_path, monkeypatch, "    kit = Parameter(1.0)\n")
    (problem,) = problems(tmp_path, f"system: tests\ncomponents:\n  odd: {{class: '{file.stem}:Odd'}}\n")
    assert (problem.line, problem.field) == (3, "components.odd.class")
    assert f"{file}:{LINE}: 'kit' cannot name a parameter" in problem.problem


def test_a_mixin_is_no_way_around_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = "\n\nclass Mixin:\n    kit = 3\n\n\nclass Mixed(Mixin, Component):\n    'Is mixed.'\n"
    file = module(tmp_path, monkeypatch, text)
    with pytest.raises(NoSuchClass, match="'kit' cannot name an attribute"):
        load_class(f"{file.stem}:Mixed")


RIGHT = """\
    handler_timeout = 1.0
    checkpoint_every = None
    exclusive = True

    def on_configure(self):
        self.kits = self.kit.name
        other = type("Other", (), {})()
        other.kit, other.snapshot = 1, 2

    @classmethod
    def estimate(cls, parameters, context):
        return {}

    def snapshot(self):
        return {"kit": 1}

    def restore(self, state):
        self.restored = state
"""


def test_overriding_as_it_is_meant_is_no_misuse(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = module(tmp_path, monkeypatch, RIGHT)
    with Rig() as rig:
        assert rig.add(load_class(f"{file.stem}:Odd")) is not None
