"""Reads the file of a study's claims; anything wrong with it is a StackError with file, line and field."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

from regraft.bus_schema.suggestions import instead_of, no_such
from regraft.evaluation.claims.model import Claim, Claims, SeedSet
from regraft.evaluation.claims.power import too_few
from regraft.evaluation.results.table import MAX_SEED
from regraft.evaluation.statistics.paired import Direction, SampleTest
from regraft.evaluation.study import Study
from regraft.stack.yaml.document import read_map
from regraft.stack.yaml.nodes import locations_of, plain
from regraft.stack.yaml.problems import Report
from regraft.stack.yaml.section import Section

FIELDS: Final = ("study", "definitions", "alpha", "power", "seeds", "claims")
OF_CLAIM: Final = (
    "text",
    "family",
    "scenarios",
    "measure",
    "first",
    "second",
    "direction",
    "smallest_effect",
    "expected",
    "sd",
    "test",
    "refuted_by",
)
NEEDED: Final = ("text", "family", "measure", "first", "second", "smallest_effect", "expected", "sd", "refuted_by")
RANGE: Final = re.compile(r"(\d{1,9})-(\d{1,9})")
MOST_SEEDS: Final = 10_000


def read_claims(file: Path, study: Study) -> Claims:
    """Return the claims of a study; raises StackError with all that is wrong."""
    document = read_map(file, f"fields such as {', '.join(FIELDS[:2])}")
    report = Report(str(file), locations_of(document))
    section = Section(document, "", report)
    section.only(*FIELDS)
    definitions = _definitions(section, study)
    if definitions not in study.configurations:
        report.raise_if_any()  # every arm and measure would be unknown
    claims = Claims(
        file=str(file),
        study=study.name,
        definitions=definitions,
        alpha=_share(section, "alpha", 0.05),
        power=_share(section, "power", 0.8),
        seeds=_seeds(section.section("seeds")),
        claims=tuple(_claims(section.section("claims"), study, definitions)),
    )
    if not claims.claims and not report.problems:
        section.wrong("claims", "is missing: a file of claims needs at least one")
    if not report.problems:
        _check_power(claims, report)
    report.raise_if_any()
    return claims


def _definitions(section: Section, study: Study) -> str:
    named = section.text("study", study.name)
    if named != study.name:
        section.wrong("study", f"is {named!r}, these are the claims of {study.name!r}")
    definitions = section.text("definitions", next(iter(study.configurations)))
    if definitions not in study.configurations:
        section.wrong(
            "definitions", f"there are no definitions {definitions!r}; {instead_of(definitions, study.configurations)}"
        )
    return definitions


def _share(section: Section, key: str, default: float) -> float:
    found = section.number(key, minimum=0.0, maximum=1.0)
    if found is not None and found in (0.0, 1.0):
        section.wrong(key, f"{found:g}: must lie between 0 and 1")
        return default
    return default if found is None else found


# --- seeds ---


def _seeds(section: Section) -> dict[SeedSet, tuple[int, ...]]:
    section.only(*(which.value for which in SeedSet))
    found: dict[SeedSet, tuple[int, ...]] = {}
    owner: dict[int, str] = {}
    for which in SeedSet:
        found[which] = tuple(_numbers(section, which.value))
        for seed in found[which]:
            if seed in owner:
                section.wrong(which.value, f"seed {seed} is a {owner[seed]} seed already: leave one out")
                break
            owner[seed] = which.value
    return found


def _numbers(section: Section, key: str) -> Iterator[int]:
    node = section.node(key)
    if node is None:
        return
    if not isinstance(node.value, tuple):
        section.wrong(key, f"must be a list of seeds and ranges such as 1-20, is {node.kind}")
        return
    count = 0
    for index, part in enumerate(node.value):
        value = plain(part)
        span = RANGE.fullmatch(value) if isinstance(value, str) else None
        if isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= MAX_SEED:
            first = last = value
        elif span is not None and int(span[1]) <= int(span[2]):
            first, last = int(span[1]), int(span[2])
        else:
            section.wrong(f"{key}.{index}", f"must be a seed such as 7 or a range such as 1-20, is {value!r}")
            continue
        count += last - first + 1
        if count > MOST_SEEDS:
            section.wrong(f"{key}.{index}", f"makes more than {MOST_SEEDS} seeds")
            return
        yield from range(first, last + 1)


# --- claims ---


def _claims(table: Section, study: Study, definitions: str) -> Iterator[Claim]:
    configurations = study.configurations.get(definitions, ())
    arms: dict[str, set[str]] = {}
    for configuration in configurations:
        arms.setdefault(configuration.scenario, set()).add(configuration.name)
    for name in table.names():
        section = table.section(name)
        section.only(*OF_CLAIM)
        for key in NEEDED:
            if key not in section:
                section.wrong(key, "is missing")
        yield from _in_scenarios(name, section, arms, study.measures.get(definitions, {}))


def _in_scenarios(
    name: str, section: Section, arms: Mapping[str, set[str]], measures: Mapping[str, object]
) -> Iterator[Claim]:
    scenarios = section.distinct("scenarios") or tuple(arms)
    measure = section.text("measure")
    if measure and measure not in measures:
        section.wrong("measure", no_such("measure", measure, measures))
    first, second = section.text("first"), section.text("second")
    for index, scenario in enumerate(scenarios):
        if scenario not in arms:
            section.wrong(f"scenarios.{index}", no_such("scenario", scenario, arms))
            continue
        for key, arm in (("first", first), ("second", second)):
            if arm and arm not in arms[scenario]:
                where = f" in the scenario {scenario!r}" if scenario else ""
                section.wrong(key, f"there is no arm {arm!r}{where}; {instead_of(arm, arms[scenario])}")
        yield _claim(f"{name}.{scenario}" if scenario else name, scenario, section)


def _claim(name: str, scenario: str, section: Section) -> Claim:
    direction = section.choice("direction", Direction, Direction.GREATER)
    smallest = section.number("smallest_effect", minimum=0.0)
    expected, sd = section.number("expected"), section.number("sd", minimum=0.0)
    if smallest == 0.0:
        section.wrong("smallest_effect", "must be more than 0: the difference that is worth having")
    elif smallest is not None and expected is not None:
        if direction is Direction.EQUAL and abs(expected) >= smallest:
            section.wrong("expected", f"{expected:g}: must be nearer to 0 than smallest_effect, {smallest:g}")
        elif direction is not Direction.EQUAL and expected <= smallest:
            why = "counted in the claim's direction, and more than smallest_effect"
            section.wrong("expected", f"{expected:g}: must be {why}, {smallest:g}, or there is nothing to claim")
    if sd == 0.0:
        section.wrong("sd", "must be more than 0: the standard deviation on tuning seeds")
    if section.text("first") and section.text("first") == section.text("second"):
        section.wrong("second", "is the first arm: an arm is compared with another")
    return Claim(
        name,
        section.text("text"),
        section.text("family"),
        scenario,
        section.text("measure"),
        section.text("first"),
        section.text("second"),
        direction,
        smallest or 1.0,
        expected if expected is not None else 1.0,
        sd if sd is not None else 0.0,
        section.choice("test", SampleTest, SampleTest.SIGN_FLIP),
        section.text("refuted_by"),
    )


def _check_power(claims: Claims, report: Report) -> None:
    """Note each claim that the confirmation seeds are too few for."""
    for claim in claims.claims:
        problem = too_few(claim, claims)
        if problem:
            name = claim.name.removesuffix(f".{claim.scenario}") if claim.scenario else claim.name
            report.add(f"claims.{name}.sd", problem)
