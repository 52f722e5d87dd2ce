"""The language accepts what the paper prints and the published grammar takes, and names the place of a mistake."""

from __future__ import annotations

import pytest

from regraft.adaptation_manager.planners.metacontrol.skills.diagnostics import Code
from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import ResultKind
from tests.metacontrol.skills.texts import (
    GOOD,
    PAPER,
    REALIZATION_OF_THE_PAPER,
    SKILLS_OF_THE_PAPER,
    at,
    checked,
    errors,
    found,
    only,
    realization,
    skill,
)


def test_the_printed_skills_pass_without_their_surplus_brace() -> None:
    assert found(SKILLS_OF_THE_PAPER) == []
    names = [each.name for each in checked(SKILLS_OF_THE_PAPER).skills.skills]
    assert names == ["to_navigate", "cover_area", "follow_wall"]


def test_the_printed_skills_are_refused_at_their_surplus_brace() -> None:
    (one,) = found(f"{SKILLS_OF_THE_PAPER}}}\n")
    assert (one.code, at(one)) == (Code.SYNTAX, (SKILLS_OF_THE_PAPER.count("\n") + 1, 1))
    assert "the end of the file, found '}'" in one.message


def test_the_printed_realization_passes_in_its_skill() -> None:
    assert found(PAPER) == []
    (slow,) = checked(PAPER).skills.realizations
    assert (slow.name, slow.skill, slow.context.text) == ("f_slow_mode", "to_navigate", "Default")
    assert [(each.quality, each.value) for each in slow.estimates] == [
        ("energy", 0.3),
        ("safety", 0.7),
        ("performance", 0.4),
    ]
    amcl, *_, laser = slow.components
    assert (amcl.observable, laser.observable) == (False, True)
    assert [each.name for each in amcl.configurations[0].parameters or ()][:2] == ["transform_tolerance", "alpha1"]


def test_a_realization_stands_alone_with_its_skill() -> None:
    alone = REALIZATION_OF_THE_PAPER.replace("f_slow_mode", "f_slow_mode of to_navigate")
    assert found(SKILLS_OF_THE_PAPER + alone) == []
    assert checked(SKILLS_OF_THE_PAPER + alone).skills.realizations[0].skill == "to_navigate"
    assert found(alone + SKILLS_OF_THE_PAPER) == []


def test_a_realization_that_stands_alone_without_a_skill_is_refused() -> None:
    one = only(SKILLS_OF_THE_PAPER + REALIZATION_OF_THE_PAPER, Code.NO_SKILL)
    assert "have 'of SKILL' behind its name" in one.message


@pytest.mark.parametrize(
    "text",
    [
        "SkillDefinitionSet { }",
        "",
        "// nothing\n/* at\nall */",
        'SkillDefinitionSet { Skill a { quality attributes [b] result { success: , error: 3, inprogress: "on" 4 } } }',
        "Skill a { quality attributes [b] input{x: bool} input{y: int, z: string} output{p: PoseStamped} "
        "result{success:} }",
        GOOD.replace("Quality [speed: 0.5];", "Quality [speed: -0.5 <environment e {narowness: 1, clutterness: 0}>];"),
        GOOD.replace("motor active", 'motor { Configuration active.A.B {a.b.c: "x", n: -3, m: } }'),
        GOOD.replace(
            "Component motor active",
            "Component motor observable { Configuration unconfigured },"
            "Component arm { Configuration active.X { a: 1 } }",
        ),
        GOOD.replace("};", "}"),
    ],
    ids=range(9),
)
def test_what_the_published_grammar_accepts_is_accepted(text: str) -> None:
    assert errors(text) == []


def test_a_quality_value_keeps_its_environments() -> None:
    text = GOOD.replace("0.5]", "0.5 <environment hall {narowness: 0.1, clutterness: 0.4}> <environment x {a: 1}>]")
    assert found(text) == []
    hall, x = checked(text).skills.realizations[0].estimates[0].environments
    assert (hall.name, hall.values) == ("hall", (("narowness", 0.1), ("clutterness", 0.4)))
    assert (x.name, x.values) == ("x", (("a", 1.0),))


def test_parameters_are_numbers_texts_and_booleans() -> None:
    components = (
        'Component motor { Configuration active { a: 1, b: 1.0, c: -2.5e-3, d: "x\\n\\"y", e: true, f: false } }'
    )
    text = skill(realization(components=components, rest="Quality [speed: 1];"))
    assert found(text) == []
    values = [
        each.value for each in checked(text).skills.realizations[0].components[0].configurations[0].parameters or ()
    ]
    assert values == [1, 1.0, -0.0025, 'x\n"y', True, False]
    assert [type(value) for value in values] == [int, float, float, str, bool, bool]


def test_results_have_a_class_and_a_text_or_number() -> None:
    text = 'Skill a { quality attributes [b] result { success: "OK", error: -1 } }'
    success, error = checked(text).skills.skills[0].results
    assert (success.kind, success.text, success.number) == (ResultKind.SUCCESS, "OK", None)
    assert (error.kind, error.text, error.number) == (ResultKind.ERROR, None, -1.0)


def test_inputs_and_outputs_have_types() -> None:
    text = "Skill a { quality attributes [b] input { goal: regraft/Pose } output { left: flot } }"
    one = only(text, Code.UNKNOWN_TYPE)
    assert one.message == "left: there is no type 'flot'; did you mean 'float'?"
    assert found(text) == [one]


@pytest.mark.parametrize(
    ("text", "place", "message"),
    [
        ("Skil a {}", (1, 1), "expected 'import', 'SkillDefinitionSet', 'Skill'"),
        ("Skill a {\n  qualities [b] }", (2, 3), "expected 'quality', found 'qualities'"),
        ("Skill a { quality attributes [1] }", (1, 31), "expected a name, found '1'"),
        ("Skill a { quality attributes [b]", (1, 33), "found the end of the file"),
        ("Skill a { quality attributes [b] result { sucess: 1 } }", (1, 43), "'success', 'error' or 'inprogress'"),
        ("Skill a { quality attributes [b] } /* never closed", (1, 36), "the comment that begins here has no end"),
        ('Quality a { measured: "1 }', (1, 23), "the text that begins here has no end"),
        ("Context A\n\n  Context 7", (3, 11), "expected a name, found '7'"),
        ("Skill a {" * 10_000, (1, 10), "expected 'quality', found 'Skill'"),
        (f"Skill a {{ quality attributes [{'[' * 90_000}", (1, 31), "expected a name, found '['"),
    ],
)
def test_a_syntax_error_is_one_error_with_its_place(text: str, place: tuple[int, int], message: str) -> None:
    (one,) = found(text)
    assert (one.code, at(one)) == (Code.SYNTAX, place)
    assert message in one.message
