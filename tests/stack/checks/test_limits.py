"""Limits in stack files: what components may use, and what is wrong with what is asked for."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.bus_schema.model.architecture import Limits
from regraft.stack import StackError, load

STACK = """\
system: tests
TOP
components:
  wheels: {command: [wheels], managed: false, limits: {memory: 512 MiB, files: 256}}
  lights: {command: [lights], managed: false OWN}
"""


def _loaded(folder: Path, top: str = "", own: str = "") -> tuple[Limits, Limits]:
    """Return the limits of the stack, and those of the component without any or with its ``own``."""
    file = folder / "stack.yaml"
    file.write_text(STACK.replace("TOP", top).replace("OWN", f", limits: {own}" if own else ""))
    architecture = load(file).architecture
    assert architecture.components["wheels"].limits == Limits(512.0, 256)
    return architecture.limits, architecture.components["lights"].limits


def test_without_limits_nothing_is_limited(tmp_path: Path) -> None:
    assert _loaded(tmp_path) == (Limits(None, None), Limits(None, None))


def test_memory_is_given_with_its_unit_or_in_mebibytes(tmp_path: Path) -> None:
    for text, mebibytes in (("100", 100.0), ("1.5 GiB", 1536.0), ("64MiB", 64.0), ("1048576 kB", 1000.0)):
        assert _loaded(tmp_path, own=f"{{memory: {text}}}")[1] == Limits(memory=mebibytes)
    assert _loaded(tmp_path, own="{memory: 512 MB}")[1].memory == pytest.approx(488.28125)


def test_a_component_has_the_limits_of_the_stack_where_it_has_none(tmp_path: Path) -> None:
    general, own = _loaded(tmp_path, "limits: {memory: 1 GiB, files: 128}", "{files: 64}")
    assert own.before(general) == Limits(1024.0, 64)


@pytest.mark.parametrize(
    ("own", "text"),
    [
        ("512 MB", "stack.yaml:5: components.lights.limits: must be a map, is a text"),
        ("{memory: 512 MO}", "limits.memory: must be an amount such as '512 MB' (kB, KiB, MB"),
        ("{memory: -5}", "stack.yaml:5: components.lights.limits.memory: is -5.0, must be at least 16.0"),
        ("{memory: 1 MB}", "limits.memory: is 0.953"),
        ("{memory: .inf}", "limits.memory: must be finite"),
        ("{memory: " + "9" * 400 + " GB}", "limits.memory: is inf, must be a finite number"),
        ("{memory: " + "9" * 400 + "}", "limits.memory: "),
        ("{files: 3}", "components.lights.limits.files: is 3, must be at least 32"),
        ("{files: many}", "limits.files: must be a whole number, is 'many'"),
        ("{files: 2000000}", "limits.files: is 2000000, must be at most 1e+06"),
        ("{file: 300}", "limits.file: there is no such field; did you mean 'files'?"),
        ("{longest_handler: 2}", "limits.longest_handler: there is no such field; it is called 'handler_timeout'"),
    ],
)
def test_what_is_wrong_with_limits_is_said(tmp_path: Path, own: str, text: str) -> None:
    with pytest.raises(StackError) as caught:
        _loaded(tmp_path, own=own)
    assert text in str(caught.value)
