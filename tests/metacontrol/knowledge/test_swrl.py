"""SWRL rules are read as they are written, and one without a meaning is named with file, rule and variable."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.adaptation_manager.planners.metacontrol.knowledge.errors import KnowledgeError
from regraft.adaptation_manager.planners.metacontrol.knowledge.knowledge_base import load
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.atoms import rule_text
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import fact_text
from tests.metacontrol.owl import HEAD, individual, rule, write


def conclusions(folder: Path, *parts: str) -> set[str]:
    """Return what follows from some parts of a file, as text."""
    known = load([write(folder, *parts, imports=())]).conclude()
    return {fact_text(fact) for fact in known.derived()}


def problem(folder: Path, *parts: str) -> str:
    """Return what is wrong with a file."""
    with pytest.raises(KnowledgeError) as caught:
        load([write(folder, *parts, imports=())])
    return str(caught.value)


def test_classes_properties_values_identity_and_builtins_are_understood(tmp_path: Path) -> None:
    assert conclusions(
        tmp_path,
        individual("a", "app:Room", app__next=[">a", ">b"], app__v=1.5),
        individual("b", "app:Room", app__v=4),
        rule("larger", ["app:v ?x ?v", "app:v ?y ?w", "swrlb:greaterThan ?w ?v"], ["app:larger ?y ?x"]),
        rule("other", ["app:next ?x ?y", "differentFrom ?x ?y"], ["app:leaves ?x ?y"]),
        rule("self", ["app:next ?x ?y", "sameAs ?x ?y"], ["app:Loop ?x"]),
        rule("sum", ["app:v app:a ?v", "app:v app:b ?w", "swrlb:add ?z ?v ?w 1"], ["app:w app:a ?z"]),
        rule("is", ["app:v ?x 4"], ["app:Four ?x"]),
    ) == {"larger(b, a)", "leaves(a, b)", "Loop(a)", "w(a, 6.5)", "Four(b)"}


def test_a_rule_as_protege_writes_it_is_understood(tmp_path: Path) -> None:
    """Lists are typed nodes, all elements are rdf:Description, names are entities, and variables are in a URN."""
    swrl = "http://www.w3.org/2003/11/swrl#"
    document = f"""<?xml version="1.0"?>
<!DOCTYPE rdf:RDF [<!ENTITY app "http://ros/application#">]>
{HEAD.partition("?>")[2]}
<owl:Ontology rdf:about="http://ros/application"/>
<rdf:Description rdf:about="&app;a"><rdf:type rdf:resource="&app;Room"/></rdf:Description>
<rdf:Description rdf:about="urn:swrl:var#x"><rdf:type rdf:resource="{swrl}Variable"/></rdf:Description>
<rdf:Description>
  <rdfs:label>published</rdfs:label>
  <rdf:type rdf:resource="{swrl}Imp"/>
  <swrl:body><rdf:Description><rdf:type rdf:resource="{swrl}AtomList"/>
    <rdf:first><rdf:Description><rdf:type rdf:resource="{swrl}ClassAtom"/>
      <swrl:classPredicate rdf:resource="&app;Room"/><swrl:argument1 rdf:resource="urn:swrl:var#x"/>
    </rdf:Description></rdf:first>
    <rdf:rest rdf:resource="http://www.w3.org/1999/02/22-rdf-syntax-ns#nil"/></rdf:Description></swrl:body>
  <swrl:head><rdf:Description><rdf:type rdf:resource="{swrl}AtomList"/>
    <rdf:first><rdf:Description><rdf:type rdf:resource="{swrl}ClassAtom"/>
      <swrl:classPredicate rdf:resource="&app;Place"/><swrl:argument1 rdf:resource="urn:swrl:var#x"/>
    </rdf:Description></rdf:first>
    <rdf:rest rdf:resource="http://www.w3.org/1999/02/22-rdf-syntax-ns#nil"/></rdf:Description></swrl:head>
</rdf:Description>
</rdf:RDF>"""
    path = tmp_path / "published.owl"
    path.write_text(document)
    knowledge = load([path])
    assert [rule_text(each) for each in knowledge.rules] == ["Room(?x) -> Place(?x)"]
    assert [fact_text(each) for each in knowledge.conclude().derived()] == ["Place(a)"]


def test_a_rule_that_is_disabled_has_no_effect(tmp_path: Path) -> None:
    enabled = "http://swrl.stanford.edu/ontologies/3.3/swrla.owl#"
    mark = f'<a:isRuleEnabled xmlns:a="{enabled}" rdf:datatype="http://www.w3.org/2001/XMLSchema#boolean">'
    off = rule("off", ["app:Room ?x"], ["app:Place ?x"]).replace(
        "<rdfs:label>", f"{mark}false</a:isRuleEnabled><rdfs:label>"
    )
    assert conclusions(tmp_path, individual("a", "app:Room"), off) == set()


@pytest.mark.parametrize(
    ("body", "head", "expected"),
    [
        (["app:Room ?x"], ["app:next ?x ?y"], "binds the variable ?y in the head, in next(?x, ?y); bound are: ?x"),
        (["app:Room ?x", "swrlb:lessThan ?v 3"], ["app:Big ?x"], "binds the variable ?v in lessThan(?v, 3)"),
        (["app:Room ?x", "differentFrom ?x ?z"], ["app:Big ?x"], "binds the variable ?z in differentFrom(?x, ?z)"),
        (["app:Room ?x", "swrlb:add ?v ?w 1"], ["app:v ?x ?v"], "binds the variable ?v in add(?v, ?w, 1)"),
        (
            ["app:Room ?x", "swrlb:lesThan 1 2"],
            ["app:Big ?x"],
            "no built-in 'lesThan'; did you mean 'lessThan'",
        ),
        (["app:Room ?x", "swrlb:lessThan 1 2 3"], ["app:Big ?x"], "lessThan has 3 arguments, must have 2"),
        (["app:Room ?x"], [], "the head is empty"),
        (["app:Room ?x"], ["sameAs ?x app:a"], "the head has identity"),
        (["app:Room ?x"], ["swrlb:equal 1 1"], "the head has a built-in"),
        (["app:c ?x"] * 101, ["app:Big ?x"], "more than 100 items"),
    ],
)
def test_a_rule_without_a_meaning_is_refused(tmp_path: Path, body: list[str], head: list[str], expected: str) -> None:
    text = rule("broken", body, head)
    if not head:
        text = text.replace(EMPTY_HEAD, f'<swrl:head rdf:resource="{NIL}"/>')
    said = problem(tmp_path, individual("a", "app:Room"), text)
    line = write(tmp_path, individual("a", "app:Room"), text, imports=()).read_text().split("<swrl:Imp>")[0].count("\n")
    assert said.startswith(f"{tmp_path / 'app.owl'}:{line + 1}: rule 'broken': ")
    assert expected in said


EMPTY_HEAD = '<swrl:head rdf:parseType="Collection">\n</swrl:head>'
NIL = "http://www.w3.org/1999/02/22-rdf-syntax-ns#nil"
GOOD = rule("broken", ["app:Room ?x"], ["app:Place ?x"])


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("swrl:ClassAtom", "swrl:ClasAtom", "an atom has ClasAtom; did you mean 'ClassAtom'?"),
        ('<swrl:argument1 rdf:resource="#x"/>', "", "an atom has 0 values of 'argument1', must have 1"),
        (
            '<swrl:argument1 rdf:resource="#x"/>',
            "<swrl:argument1>five</swrl:argument1>",
            "an atom has the value 'five' where",
        ),
        ("swrl:body", "swrl:bdy", "its body has 0 values of 'body', must have 1"),
        (
            '<swrl:classPredicate rdf:resource="http://ros/application#Room"/>',
            "<swrl:classPredicate><owl:Class/></swrl:classPredicate>",
            "an atom's class is an expression, must have a name",
        ),
    ],
)
def test_an_atom_that_is_not_as_swrl_has_it_is_refused(tmp_path: Path, old: str, new: str, expected: str) -> None:
    said = problem(tmp_path, individual("a", "app:Room"), GOOD.replace(old, new))
    assert f"rule 'broken': {expected}" in said


def test_a_list_without_an_end_is_refused(tmp_path: Path) -> None:
    circle = (
        '<rdf:Description rdf:nodeID="l"><rdf:first rdf:nodeID="f"/><rdf:rest rdf:nodeID="l"/></rdf:Description>'
        '<swrl:ClassAtom rdf:nodeID="f"><swrl:classPredicate rdf:resource="http://ros/application#Room"/>'
        '<swrl:argument1 rdf:resource="#x"/></swrl:ClassAtom>'
        '<swrl:Imp><rdfs:label>endless</rdfs:label><swrl:body rdf:nodeID="l"/>'
        '<swrl:head rdf:nodeID="l"/></swrl:Imp><swrl:Variable rdf:about="#x"/>'
    )
    assert "rule 'endless': its body is a list of more than 100 items, or one without an end" in problem(
        tmp_path, circle
    )


def test_a_rule_added_to_the_domain_file_changes_the_conclusion(tmp_path: Path) -> None:
    application = write(tmp_path, individual("nav:camera", app__v=0.2), imports=("http://domain",))
    for added, expected in ((False, set()), (True, {'c_status(camera, "FALSE")'})):
        dark = rule("dark", ["app:v ?x ?v", "swrlb:lessThan ?v 0.5"], ['tomasys:c_status ?x "FALSE"'])
        domain = write(
            tmp_path, dark if added else "", name="domain.owl", ontology="http://domain", imports=("http://ros/mros",)
        )
        known = load([application, domain]).conclude()
        assert {fact_text(each) for each in known.of("http://metacontrol.org/tomasys#c_status")} == expected
