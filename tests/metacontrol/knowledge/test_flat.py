"""Plain RDF/XML is read without rdflib, with the same triples; all other RDF/XML is left to rdflib."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rdflib import Graph

from regraft.adaptation_manager.planners.metacontrol.knowledge.errors import KnowledgeError
from regraft.adaptation_manager.planners.metacontrol.knowledge.owl.imports import ONTOLOGIES
from regraft.adaptation_manager.planners.metacontrol.knowledge.owl.scanning import scan
from regraft.adaptation_manager.planners.metacontrol.skills.generators.owl import individuals
from regraft.adaptation_manager.planners.metacontrol.skills.reading import LIBRARY, read_skills
from tests.metacontrol.owl import HEAD, individual, published_designs, write

BASE = "file:///somewhere/app.owl"


def triples(text: str) -> set[tuple[object, ...]] | None:
    """Return the triples that are read without rdflib, None where rdflib has to read them."""
    found = scan(text.encode(), "app.owl", BASE).triples
    return None if found is None else set(found)


def by_rdflib(text: str) -> set[tuple[object, ...]]:
    """Return the triples as rdflib reads them."""
    return set(Graph().parse(data=text, format="xml", publicID=BASE))


def with_body(body: str) -> str:
    return f"{HEAD}{body}</rdf:RDF>"


A = 'rdf:about="http://a.org/x#a"'


@pytest.mark.parametrize(
    "body",
    [
        published_designs(),
        f"<app:Room {A}/>",
        f'<rdf:Description {A}><rdf:type rdf:resource="http://a.org/Room"/></rdf:Description>',
        f"<app:Room {A}><app:v/><app:w></app:w><app:u> a <!-- no text --> b </app:u></app:Room>",
        f'<app:Room {A}><app:v rdf:datatype="http://www.w3.org/2001/XMLSchema#decimal">0.50</app:v></app:Room>',
        f'<app:Room {A}><app:v rdf:datatype="http://www.w3.org/2001/XMLSchema#boolean">perhaps</app:v></app:Room>',
        f'<app:Room {A}><app:near rdf:resource="http://a.org/x#b"> </app:near></app:Room>',
        f"<app:Room {A}><app:v>&lt;&amp;\u00e9</app:v></app:Room>",
    ],
)
def test_plain_descriptions_are_read_as_rdflib_reads_them(body: str) -> None:
    found = triples(with_body(body))
    assert found is not None
    assert found == by_rdflib(with_body(body))


@pytest.mark.parametrize(
    "body",
    [
        '<app:Room rdf:about="#a"/>',
        '<app:Room rdf:about="http://a.org/x#"/>',
        '<app:Room rdf:about="HTTP://a.org/x"/>',
        '<app:Room rdf:about="http://a.org/x?y"/>',
        "<app:Room/>",
        '<app:Room rdf:ID="a"/>',
        '<app:Room rdf:nodeID="a"/>',
        f'<app:Room {A} app:v="1"/>',
        f'<app:Room {A} xml:lang="en"><app:v>one</app:v></app:Room>',
        f'<app:Room {A}><app:v xml:lang="en">one</app:v></app:Room>',
        f"<app:Room {A}><app:near><app:Room/></app:near></app:Room>",
        f'<app:Room {A}><app:near rdf:parseType="Resource"/></app:Room>',
        f'<app:Room {A}><app:near rdf:resource="b"/></app:Room>',
        f'<app:Room {A}><app:near rdf:resource="http://a.org/b">text</app:near></app:Room>',
        f'<app:Room {A}><app:near rdf:resource="http://a.org/b" rdf:datatype="http://a.org/c"/></app:Room>',
        f"<app:Room {A}>text</app:Room>",
        f"<app:Room {A}><rdf:li>one</rdf:li></app:Room>",
        f"<rdf:Bag {A}/>",
        f"<rdf:li {A}/>",
    ],
)
def test_everything_else_is_left_to_rdflib(body: str) -> None:
    assert triples(with_body(body)) is None


def test_what_is_generated_is_plain_and_rules_are_not() -> None:
    made = individuals(read_skills(LIBRARY / "navigation.skills")).text
    assert triples(made) == by_rdflib(made)
    assert triples((ONTOLOGIES / "mros.owl").read_text()) is None


PLAIN = with_body(published_designs() + individual("a", "tomasys:Function", app__v="text", app__w=True))
PIECES = st.sampled_from(
    ["#", "/", " ", "x", "1", "rdf:", "app:", 'rdf:ID="a"', "rdf:nodeID", "xml:lang", 'xml:base="http://b/"', "<", "/>"]
)


@settings(max_examples=400, deadline=None)
@given(st.data())
def test_any_change_leaves_the_triples_those_of_rdflib(data: st.DataObject) -> None:
    text = PLAIN
    for _ in range(data.draw(st.integers(1, 3))):
        place = data.draw(st.integers(len(HEAD) - 200, len(text)))
        cut = data.draw(st.integers(0, 20))
        text = text[:place] + data.draw(PIECES) + text[place + cut :]
    try:
        found = triples(text)
    except (KnowledgeError, UnicodeEncodeError):
        return
    if found is not None:
        assert found == by_rdflib(text)


def test_a_base_changes_no_absolute_iri(tmp_path: Path) -> None:
    text = write(tmp_path, published_designs()).read_text()
    assert 'xml:base="http://ros/application"' in text
    assert triples(text) == by_rdflib(text)
