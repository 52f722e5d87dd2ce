"""Names are bounded where they are declared, and lists of names hold none twice."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft import Component, Output, Parameter, Resources
from regraft.bus_schema.errors import BadKey, BadType
from regraft.bus_schema.messages.sensors import Odometry
from regraft.component.component import describe
from tests.stack.reading.files import line_of, problems

HEAD = "system: tests\n"
LONG, LONGER = "a" * 65, "a" * 129
PROGRAM = "components:\n  siren: {command: [siren]"
WORD = "letters, digits, _ and -, at most 64"
OWN = "must be 1 to 128 characters"

CASES = {
    "system": (f"system: {LONG}\n{PROGRAM}}}\n", "system", WORD),
    "host": (f"{HEAD}hosts: [{LONG}]\n{PROGRAM}}}\n", "hosts.0", f"cannot name a host: must be a word of {WORD}"),
    "topic": (f"{HEAD}topics: {{{LONG}: regraft/Twist}}\n{PROGRAM}}}\n", f"topics.{LONG}", WORD),
    "component": (f"{HEAD}components:\n  {LONG}: {{command: [a]}}\n", f"components.{LONG}", WORD),
    "service": (
        f"{HEAD}{PROGRAM}, services: {{honk: {LONG}}}}}\n",
        "components.siren.services.honk",
        f"cannot name a service: must be at most 8 words joined by '/', each of {WORD}",
    ),
    "own service": (f"{HEAD}{PROGRAM}, services: {{{LONGER}: honk}}}}\n", f"components.siren.services.{LONGER}", OWN),
    "parameter": (f"{HEAD}{PROGRAM}, parameters: {{{LONGER}: 1}}}}\n", f"components.siren.parameters.{LONGER}", OWN),
    "port": (
        f"{HEAD}topics: {{a: regraft/Twist}}\n{PROGRAM}, outputs: {{{LONGER}: regraft/Twist}}, connect: "
        f"{{{LONGER}: a}}}}\n",
        f"components.siren.connect.{LONGER}",
        OWN,
    ),
    "mode": (
        f"{HEAD}{PROGRAM}, parameters: {{volume: 3}}}}\nmodes:\n  {LONGER}:\n"
        "    - {change: set_parameters, component: siren, parameters: {volume: 1}}\n",
        f"modes.{LONGER}",
        OWN,
    ),
}


@pytest.mark.parametrize("kind", CASES)
def test_a_name_that_is_too_long_is_told_with_the_limit(tmp_path: Path, kind: str) -> None:
    text, field, limit = CASES[kind]
    (problem,) = problems(tmp_path, text)
    assert (problem.field, problem.line) == (field, line_of(text, "aaaaaa"))
    assert limit in problem.problem


def test_a_name_of_5000_characters_is_not_repeated(tmp_path: Path) -> None:
    (problem,) = problems(tmp_path, f"system: {'a' * 5000}\n{PROGRAM}}}\n")
    assert "(5000 characters) cannot name a system" in problem.problem
    assert len(problem.problem) < 250


def test_a_key_that_is_too_long_for_yaml_is_told_as_that(tmp_path: Path) -> None:
    for text in (f"{HEAD}components:\n  {'a' * 5000}: {{}}\n", f"{HEAD}components:\n  {{{'a' * 5000}: b}}\n"):
        (problem,) = problems(tmp_path, text)
        assert problem.line == 3
        assert "a key of 5000 characters" in problem.problem
        assert "must be at most 1024" in problem.problem


def test_a_class_has_no_longer_names_either() -> None:
    for attribute, kind in ((Parameter(1.0), "parameter"), (Output(Odometry), "port")):
        with pytest.raises(BadKey, match=f"cannot name a {kind}: must be 1 to 128 characters"):
            describe(type("Odd", (Component,), {LONGER: attribute}))


def test_the_resources_of_a_class_have_no_blanks_in_their_names() -> None:
    for needs, place in ((Resources(devices=("arm", "a b")), "devices.1"), (Resources(amounts={"": 1.0}), "amounts.")):
        with pytest.raises(BadType, match=rf"resources\.{place}.* cannot name an? (device|amount)"):
            describe(type("Odd", (Component,), {"resources": needs}))


@pytest.mark.parametrize(
    ("more", "field"),
    [
        ("hosts: [edge, arm, edge]\n", "hosts.2"),
        ("hosts: {edge: {devices: [gripper, gripper]}}\n", "hosts.edge.devices.1"),
        ("imports: [regraft.bus_schema, regraft.bus_schema]\n", "imports.1"),
        ("constraints: [{at_most_one_active: [siren, siren]}]\n", "constraints.0.at_most_one_active.1"),
    ],
)
def test_a_name_that_is_given_twice_is_refused(tmp_path: Path, more: str, field: str) -> None:
    (problem,) = problems(tmp_path, f"{HEAD}{more}{PROGRAM}}}\n")
    assert problem.field == field
    assert problem.problem.endswith("is given twice: leave one out")


def test_the_first_host_is_not_named_among_the_further_ones(tmp_path: Path) -> None:
    (problem,) = problems(tmp_path, f"{HEAD}hosts: [edge, local]\n{PROGRAM}}}\n")
    assert (problem.line, problem.field) == (2, "hosts.1")
    assert problem.problem == "'local' is the first host, which is there without being named"
