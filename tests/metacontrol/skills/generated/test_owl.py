"""The generated ontology has 2 + 4q + r assertions for a realization, and nothing that points nowhere."""

from __future__ import annotations

import pytest
import rdflib
from rdflib.namespace import RDF

from regraft.adaptation_manager.planners.metacontrol.skills.counting import Count, counts
from regraft.adaptation_manager.planners.metacontrol.skills.generators.owl import individuals
from regraft.adaptation_manager.planners.metacontrol.skills.generators.rdf_lines import Namespaces
from tests.metacontrol.skills.texts import GOOD, PAPER, checked, errors, realization, skill

TOMASYS = rdflib.Namespace("http://metacontrol.org/tomasys#")
MROS = rdflib.Namespace("http://ros/mros#")
DOMAIN = rdflib.Namespace("http://ros/navigation_domain#")


def graph(text: str, namespaces: Namespaces | None = None) -> rdflib.Graph:
    """Return the graph of the generated ontology."""
    assert errors(text) == []
    found = rdflib.Graph()
    found.parse(data=individuals(checked(text).skills, namespaces or Namespaces()).text, format="xml")
    return found


def counted(text: str) -> dict[str, Count]:
    """Return the counts by realization."""
    assert errors(text) == []
    return {each.realization.name: each for each in counts(individuals(checked(text).skills))}


def test_the_printed_realization_has_the_papers_fifteen_assertions() -> None:
    one = counted(PAPER)["f_slow_mode"]
    assert (one.objects, one.data, one.classes, one.assertions) == (8, 3, 4, 15)
    assert one.lines <= 20


def test_the_published_assertions_are_exactly_the_papers_and_only_the_context_is_added() -> None:
    found = graph(PAPER)
    design = DOMAIN.f_slow_mode
    values = {name: DOMAIN[f"qa_{name}_f_slow_mode"] for name in ("safety", "performance", "energy")}
    classes = {(design, RDF.type, TOMASYS.FunctionDesign)}
    classes |= {(value, RDF.type, TOMASYS.QAvalue) for value in values.values()}
    objects = {(design, TOMASYS.solvesF, DOMAIN.to_navigate), (DOMAIN.laser_resender, MROS.requiredBy, design)}
    objects |= {(design, TOMASYS.hasQAestimation, value) for value in values.values()}
    objects |= {(value, TOMASYS.isQAtype, MROS[name]) for name, value in values.items()}
    data = {(value, TOMASYS.hasValue, found.value(value, TOMASYS.hasValue)) for value in values.values()}
    assert (len(objects), len(data), len(classes)) == (8, 3, 4)
    about = {triple for triple in found if design in triple or triple[0] in values.values()}
    own = (design, MROS.fd_context, rdflib.Literal("Default", datatype=rdflib.XSD.string))
    assert about == classes | objects | data | {own}
    assert counted(PAPER)["f_slow_mode"].own == 1


def test_required_skills_are_objectives_with_bounds_that_are_counted_apart() -> None:
    text = skill(realization(), name="look") + skill(
        realization(rest="Quality [speed: 1]; requires look [speed >= 0.5];"), name="go_there"
    )
    found = graph(text)
    (objective,) = found.objects(DOMAIN.go_there_go, MROS.fd_requiresO)
    assert found.value(objective, RDF.type) == TOMASYS.Objective
    assert found.value(objective, TOMASYS.typeF) == DOMAIN.look
    (bound,) = found.objects(objective, TOMASYS.hasNFR)
    assert (str(found.value(bound, TOMASYS.hasValue)), found.value(bound, TOMASYS.isQAtype)) == ("0.5", MROS.speed)
    look, go = counts(individuals(checked(text).skills))
    assert [(each.assertions, each.own) for each in (look, go)] == [(2, 1), (6, 8)]


@pytest.mark.parametrize("q", [0, 1, 4])
@pytest.mark.parametrize("r", [0, 1, 3])
def test_a_realization_has_as_many_assertions_as_its_qualities_and_observable_components_ask(q: int, r: int) -> None:
    names = [f"q{number}" for number in range(max(q, 1))]
    estimates = f"Quality [{', '.join(f'{name}: 0.5' for name in names)}];" if q else ""
    components = [f"Component c{number} observable active" for number in range(r)]
    others = ["Component x active", "Component y observable inactive"]
    text = skill(realization(components=", ".join([*components, *others]), rest=estimates), qualities=", ".join(names))
    one = counted(text)["go"]
    assert (one.objects, one.data, one.classes) == (1 + 2 * q + r, q, 1 + q)
    assert one.assertions == 2 + 4 * q + r


def test_a_design_solves_its_skill_and_has_values_of_quality_types() -> None:
    found = graph(PAPER)
    design = DOMAIN.f_slow_mode
    assert (design, RDF.type, TOMASYS.FunctionDesign) in found
    assert (design, TOMASYS.solvesF, DOMAIN.to_navigate) in found
    values = {
        found.value(value, TOMASYS.isQAtype): found.value(value, TOMASYS.hasValue)
        for value in found.objects(design, TOMASYS.hasQAestimation)
    }
    assert {
        str(kind): (str(value), value.datatype) for kind, value in values.items() if isinstance(value, rdflib.Literal)
    } == {
        str(MROS.safety): ("0.7", rdflib.XSD.decimal),
        str(MROS.performance): ("0.4", rdflib.XSD.decimal),
        str(MROS.energy): ("0.3", rdflib.XSD.decimal),
    }
    assert list(found.objects(DOMAIN.laser_resender, MROS.requiredBy)) == [design]


def test_all_that_is_pointed_to_has_a_type() -> None:
    found = graph(PAPER)
    pointed = {value for _, predicate, value in found if predicate != RDF.type and isinstance(value, rdflib.URIRef)}
    imported = set(found.objects(None, rdflib.OWL.imports))
    assert [each for each in pointed - imported if found.value(each, RDF.type) is None] == []


def test_a_realization_name_of_two_skills_is_two_designs_of_one_value_each() -> None:
    text = skill(realization(), name="a") + skill(realization(), name="b")
    found = graph(text)
    assert {
        str(design): str(found.value(design, TOMASYS.solvesF))
        for design in found.subjects(RDF.type, TOMASYS.FunctionDesign)
    } == {
        str(DOMAIN.a_go): str(DOMAIN.a),
        str(DOMAIN.b_go): str(DOMAIN.b),
    }


@pytest.mark.parametrize("name", ["move", "motor", "qa_speed_x", "f", "f_f_normal_mode", "_"])
def test_individuals_have_one_class_whatever_a_realization_is_called(name: str) -> None:
    text = skill(
        realization(name, "Component motor observable active", "Quality [speed: 1];"),
        realization("x", "Component arm active", "Quality [speed: 0.1];"),
    )
    found = graph(text)
    classes = [len(set(found.objects(each, RDF.type))) for each in set(found.subjects(RDF.type))]
    assert set(classes) == {1}
    assert len(set(found.subjects(RDF.type, TOMASYS.FunctionDesign))) == 2
    assert [each.assertions for each in counted(text).values()] == [7, 6]


def test_a_quality_given_twice_is_one_assertion() -> None:
    one = counted(PAPER.replace("energy: 0.3,", "energy: 0.3, energy: 0.3,"))["f_slow_mode"]
    assert one.assertions == 15


def test_a_value_that_holds_everywhere_goes_before_those_of_environments() -> None:
    text = GOOD.replace("speed: 0.5", "speed: 0.1 <environment e {a: 1}>, speed: 0.5")
    assert [str(value) for value in graph(text).objects(None, TOMASYS.hasValue)] == ["0.5"]


def test_rest_and_the_unrealisable_are_no_choices_and_rest_is_marked() -> None:
    text = skill(
        realization(),
        realization("parked", "Component motor inactive", "Quality [speed: 100];"),
        realization("x", "Component motor active, Component arm activating"),
    )
    assert list(counted(text)) == ["go"]
    found = graph(text)
    assert set(found.subjects(RDF.type, TOMASYS.FunctionDesign)) == {DOMAIN.go, DOMAIN.parked}
    assert [subject for subject, _ in found.subject_objects(MROS.fd_is_rest)] == [DOMAIN.parked]
    assert list(found.objects(DOMAIN.parked, TOMASYS.hasQAestimation)) == []


def test_observable_components_count_only_where_they_are_active() -> None:
    text = skill(
        realization("a", "Component m observable active.X"),
        realization("b", "Component m inactive, Component n active"),
        realization("c", "Component m { Configuration inactive, Configuration active.Y }"),
    )
    assert {name: each.assertions for name, each in counted(text).items()} == {"a": 3, "b": 2, "c": 3}


def test_namespaces_are_options() -> None:
    found = graph(GOOD, Namespaces("http://a.org/t#", "http://a.org/m/", "http://a.org/d?x&y#"))
    spaces = {str(part).rpartition("#")[0] for triple in found for part in triple if "a.org/d" in str(part)}
    assert spaces == {"http://a.org/d?x&y", ""}
    assert not [part for triple in found for part in triple if "metacontrol.org" in str(part)]


@pytest.mark.parametrize("value", ["0.1", "1e-9", "123456789012345680000", "-3", "0"])
def test_values_are_decimals_without_exponents(value: str) -> None:
    found = graph(GOOD.replace("0.5", value))
    (literal,) = found.objects(None, TOMASYS.hasValue)
    assert "e" not in str(literal).lower()
    assert float(str(literal)) == float(value)
