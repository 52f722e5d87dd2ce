"""No text crashes the checks, and what they accept can be generated and read back."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import rdflib
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from regraft.adaptation_manager.planners.metacontrol.skills.diagnostics import Code, Severity
from regraft.adaptation_manager.planners.metacontrol.skills.generators.writing import generated
from regraft.adaptation_manager.planners.metacontrol.skills.outline import outline_of, outline_plain
from regraft.adaptation_manager.planners.metacontrol.skills.reading import LIBRARY
from regraft.stack.sections.system_modes import read_system_modes
from tests.metacontrol.skills.texts import PAPER, REALIZATION_OF_THE_PAPER, SKILLS_OF_THE_PAPER, checked

SEEDS = (
    PAPER,
    SKILLS_OF_THE_PAPER + REALIZATION_OF_THE_PAPER.replace("f_slow_mode", "f_slow_mode of follow_wall"),
    (LIBRARY / "navigation_definitions.skills").read_text()
    + (LIBRARY / "navigation.skills").read_text().replace('import "navigation_definitions.skills"', ""),
)
PIECES = (
    *("{", "}", "[", "]", "(", ")", ",", ";", ":", ".", "..", "<", ">", "/*", "*/", "//", '"', "'", "\\", "\n", "\0"),
    *("Skill", "Realization", "Component", "Configuration", "Quality", "context", "requires", "of", "observable"),
    *("active", "active.DEFAULT", "inactive", "finalized", "0", "-1", "1e999", "true", "é", "\u2028", "\U0001f600"),
)


def check(text: str) -> None:
    """Check a text; if it is accepted, generate from it and read that back."""
    found = checked(text)
    assert all(each.place.line >= 1 and each.place.column >= 1 for each in found.diagnostics)
    assert all(each.message for each in found.diagnostics)
    syntax = [each for each in found.diagnostics if each.code is Code.SYNTAX]
    assert len(syntax) <= 1
    outline_plain(outline_of(found.skills))
    if any(each.severity is Severity.ERROR for each in found.diagnostics):
        return
    modes, observed, qualities, owl = generated(found.skills).values()
    assert isinstance(yaml.safe_load(observed), dict)
    assert isinstance(yaml.safe_load(qualities), dict)
    rdflib.Graph().parse(data=owl, format="xml")
    components = {each.name.replace("/", ".") for one in found.skills.realizations for each in one.components}
    if yaml.safe_load(modes) is not None:
        with TemporaryDirectory() as folder:
            file = Path(folder, "modes.yaml")
            file.write_text(modes, encoding="utf-8")
            read_system_modes(file, components)


@given(st.text(max_size=300))
def test_no_text_crashes_the_checks(text: str) -> None:
    check(text)


@given(st.lists(st.sampled_from(PIECES), max_size=60))
def test_no_words_of_the_language_in_any_order_crash_the_checks(pieces: Sequence[str]) -> None:
    check(" ".join(pieces))


@st.composite
def damaged(draw: st.DrawFn) -> str:
    """Return a valid file with parts removed, doubled, moved or replaced."""
    text = draw(st.sampled_from(SEEDS))
    for _ in range(draw(st.integers(1, 4))):
        start = draw(st.integers(0, len(text)))
        end = min(len(text), start + draw(st.integers(0, 80)))
        kind = draw(st.sampled_from(("remove", "double", "insert", "replace", "move")))
        piece = text[start:end]
        if kind == "move":
            to = draw(st.integers(0, len(text)))
            text = text[:to] + piece + text[to:]
            continue
        inserted = (
            draw(st.sampled_from(PIECES)) if kind in ("insert", "replace") else piece * 2 if kind == "double" else ""
        )
        text = text[:start] + inserted + text[start if kind == "insert" else end :]
    return text


@given(damaged())
@settings(max_examples=150)
def test_no_damaged_file_crashes_the_checks(text: str) -> None:
    check(text)


NAMES = st.sampled_from(("a", "A", "b", "null", "yes", "DEFAULT", "active", "context", "r_2", "r"))


@st.composite
def valid(draw: st.DrawFn) -> str:
    """Return a text that the grammar accepts, with names that are words elsewhere."""
    texts = []
    for _ in range(draw(st.integers(1, 3))):
        realizations = []
        for _ in range(draw(st.integers(0, 3))):
            components = []
            for name in draw(st.lists(NAMES, min_size=1, max_size=3, unique=True)):
                mode = draw(
                    st.sampled_from(("active", "inactive", "active.X", "active.X.Y", "active.X_Y", "finalized"))
                )
                number = draw(st.floats(-1e300, 1e300) | st.integers(-(2**63), 2**63 - 1))
                value = draw(st.sampled_from((f"{number!r}".replace("e+", "e"), "true", '"\\n\U0001f600\\\\"', '"no"')))
                observable = draw(st.sampled_from(("", "observable")))
                components.append(f"Component c_{name} {observable} {{ Configuration {mode} {{ {name}.p: {value} }} }}")
            quality = f"Quality [q: {draw(st.floats(0, 1))}]"
            realizations.append(f"Realization {draw(NAMES)} {{ {', '.join(components)} {quality} context: Default }}")
        texts.append(f"Skill {draw(NAMES)} {{ quality attributes [q] {' '.join(realizations)} }}")
    return "\n".join(texts)


@given(valid())
@settings(max_examples=150)
def test_what_is_accepted_can_be_generated_and_read_back(text: str) -> None:
    check(text)
