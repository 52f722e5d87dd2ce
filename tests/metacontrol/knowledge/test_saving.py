"""A knowledge base is saved whole or not at all, always in the same way, and loads again as it was."""

from __future__ import annotations

import resource
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rdflib import RDF, RDFS, BNode, Graph, Literal, URIRef
from rdflib.compare import isomorphic
from rdflib.term import Node

from regraft.adaptation_manager.planners.metacontrol.knowledge import vocabulary
from regraft.adaptation_manager.planners.metacontrol.knowledge.errors import KnowledgeError
from regraft.adaptation_manager.planners.metacontrol.knowledge.knowledge_base import LEVELS, load
from regraft.adaptation_manager.planners.metacontrol.knowledge.owl.rdf_xml import write_rdf_xml
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import text
from regraft.adaptation_manager.planners.metacontrol.knowledge.saving import save
from tests.metacontrol.owl import BATTERY, individual, iri, published_designs, rule, write

FACT = (vocabulary.C_STATUS, iri(BATTERY), text("FALSE"))


def test_what_was_saved_loads_again_by_itself(tmp_path: Path) -> None:
    knowledge = load([write(tmp_path, published_designs(), rule("own", ["app:A ?x"], ["app:B ?x"])), *LEVELS])
    path = tmp_path / "saved.owl"
    save(knowledge, path, [FACT])
    again = load([path])
    assert again.files == (str(path),)
    assert set(again.facts) == {*knowledge.facts, FACT}
    assert set(again.rules) == set(knowledge.rules)
    assert again.axioms == knowledge.axioms


def test_the_same_content_gives_the_same_bytes_in_every_process(tmp_path: Path) -> None:
    write(tmp_path, published_designs())
    program = (
        "import sys; from pathlib import Path;"
        "from regraft.adaptation_manager.planners.metacontrol.knowledge.knowledge_base import load;"
        "from regraft.adaptation_manager.planners.metacontrol.knowledge.saving import save;"
        "save(load([sys.argv[1]]), Path(sys.argv[2]))"
    )
    found = set()
    for seed in ("1", "2"):
        out = tmp_path / f"{seed}.owl"
        command = [sys.executable, "-c", program, str(tmp_path / "app.owl"), str(out)]
        subprocess.run(command, check=True, env={"PYTHONHASHSEED": seed}, timeout=120)
        found.add(out.read_bytes())
    save(load([tmp_path / "1.owl"]), tmp_path / "again.owl")
    assert found == {(tmp_path / "again.owl").read_bytes()}


def test_a_full_disk_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "saved.owl"
    path.write_text("old")
    knowledge = load(LEVELS)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limits[1]))
    try:
        with pytest.raises(KnowledgeError) as caught:
            save(knowledge, path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert str(caught.value) == f"{path}: cannot be written: File too large"
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(KnowledgeError, match=r"none/saved.owl: cannot be written: No such file or directory"):
        save(load(LEVELS), tmp_path / "none" / "saved.owl")


def test_what_xml_cannot_hold_is_refused(tmp_path: Path) -> None:
    with pytest.raises(KnowledgeError, match="which XML cannot hold"):
        save(load(LEVELS), tmp_path / "saved.owl", [("http://t#note", "http://t#a", text("a\x00b"))])
    with pytest.raises(KnowledgeError, match="must end with a name to be written as XML"):
        save(load(LEVELS), tmp_path / "saved.owl", [("http://t#1", "http://t#a", "http://t#b")])
    assert not (tmp_path / "saved.owl").exists()


def test_texts_of_several_lines_and_languages_stay_as_they_are(tmp_path: Path) -> None:
    note = '<rdfs:comment xml:lang="nl">twee\n  regels &amp; "tekens" &lt;\r&#13;</rdfs:comment></rdf:Description>'
    path = write(tmp_path, individual("a", "tomasys:Function").replace("</rdf:Description>", note))
    saved = tmp_path / "saved.owl"
    save(load([path]), saved)
    found = []
    for file in (path, saved):
        graph = Graph().parse(file, format="xml")
        found.append(set(graph.objects(URIRef(iri("a")), RDFS.comment)))
    assert found[0] == found[1]


IRIS = st.sampled_from([URIRef(f"http://x#{name}") for name in "abc"])
NODES: st.SearchStrategy[Node] = st.one_of(IRIS, st.builds(BNode, st.sampled_from("xyz")))
PREDICATES = st.sampled_from([URIRef("http://p#p"), URIRef("http://q/q"), RDF.rest, RDF.first])
TEXTS = st.builds(Literal, st.sampled_from(["a", "<b>", "  c\n"]))
VALUES: st.SearchStrategy[Node] = st.one_of(NODES, TEXTS, st.builds(Literal, st.integers(0, 3)))
TRIPLES = st.lists(st.tuples(NODES, PREDICATES, VALUES), max_size=6)


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(NODES, PREDICATES, VALUES), max_size=6), st.randoms(use_true_random=False))
def test_a_graph_is_written_without_loss_and_in_one_way(triples: list[tuple[Node, Node, Node]], chance: object) -> None:
    graph = Graph()
    for triple in triples:
        graph.add(triple)
    written = write_rdf_xml(graph)
    assert isomorphic(Graph().parse(data=written, format="xml"), graph)
    other: Graph = Graph()
    chance.shuffle(triples)  # type: ignore[attr-defined]
    for triple in triples:
        subject, predicate, value = (BNode(f"r{node}") if isinstance(node, BNode) else node for node in triple)
        other.add((subject, predicate, value))
    assert write_rdf_xml(other) == written
