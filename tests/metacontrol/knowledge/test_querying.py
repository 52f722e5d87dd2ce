"""SPARQL queries are answered within bounds, and ask nobody else."""

from __future__ import annotations

import pytest

from regraft.adaptation_manager.planners.metacontrol.knowledge import querying, vocabulary
from regraft.adaptation_manager.planners.metacontrol.knowledge.knowledge_base import KnowledgeBase, load
from regraft.adaptation_manager.planners.metacontrol.knowledge.querying import QueryError, query
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import text
from tests.metacontrol.owl import BATTERY, REALIZATIONS, iri, published_designs, write


@pytest.fixture(scope="module")
def knowledge(tmp_path_factory: pytest.TempPathFactory) -> KnowledgeBase:
    return load([write(tmp_path_factory.mktemp("kb"), published_designs())])


def test_select_has_columns_and_rows(knowledge: KnowledgeBase) -> None:
    found = query(
        knowledge,
        "SELECT ?design ?value WHERE { ?design tomasys:hasQAestimation ?q . ?q tomasys:isQAtype mros:safety ;"
        " tomasys:hasValue ?value FILTER (?value >= 0.7) } ORDER BY ?design",
    )
    assert found.columns == ("design", "value")
    assert found.rows == ((iri("normal"), 0.8), (iri("slow"), 0.7))
    assert found.answer is None


def test_ask_has_an_answer(knowledge: KnowledgeBase) -> None:
    failed = "ASK { ?c tomasys:c_status 'FALSE' }"
    assert query(knowledge, failed).answer is False
    assert query(knowledge, failed, [(vocabulary.C_STATUS, iri(BATTERY), text("FALSE"))]).answer is True


def test_the_columns_of_all_variables_are_sorted_and_what_is_unbound_is_none(knowledge: KnowledgeBase) -> None:
    found = query(
        knowledge, "select * where { ?b a tomasys:FunctionDesign OPTIONAL { ?b mros:fd_context ?a } } order by ?b"
    )
    assert found.columns == ("a", "b")
    assert found.rows == tuple((None, iri(name)) for name in sorted(REALIZATIONS))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("SELECT * { SERVICE <http://localhost/> { ?a ?b ?c } }", "SERVICE asks another machine"),
        ("SELECT * { ?a ?b ?c FILTER EXISTS { SERVICE SILENT <http://x/> { ?a ?b ?c } } }", "SERVICE asks"),
        ("SELECT * { { SELECT * { SERVICE <http://x/> { ?a ?b ?c } } } }", "SERVICE asks"),
        ("SELECT * FROM <http://x/> { ?a ?b ?c }", "FROM loads other data"),
        ("ASK FROM NAMED <http://x/> { GRAPH ?g { ?a ?b ?c } }", "FROM loads other data"),
        ("SELECT * { ?a ?b ?c FILTER REGEX(STR(?a), '(a+)+$') }", "REGEX may take any time"),
        ("SELECT (REPLACE(STR(?a), '(a+)+$', '') AS ?x) { ?a ?b ?c }", "REPLACE may take any time"),
        ("SELECT (CONCAT(?x, ?x) AS ?y) { ?a ?b ?x }", "CONCAT may make texts of any length"),
        ("CONSTRUCT { ?a ?b ?c } WHERE { ?a ?b ?c }", "this is a ConstructQuery, must be SELECT or ASK"),
        ("DESCRIBE <x:y>", "this is a DescribeQuery, must be SELECT or ASK"),
        ("INSERT DATA { <a:b> <c:d> <e:f> }", "line 1, column 1: this is no SELECT or ASK query"),
        ("LOAD <http://x/>", "line 1, column 1: this is no SELECT or ASK query"),
        ("", "this is no SELECT or ASK query"),
        ("SELECT ?x { ?x foo:bar ?y }", "the query is wrong: Unknown namespace prefix : foo"),
        ("SELECT ?x {" + "{" * 30 + "}" * 30 + "}", "has 31 brackets inside each other, must have at most 20"),
        ("SELECT ?x { ?x ?y ?z }" + " " * 20_000, "has 20022 characters, must have at most 16384"),
    ],
)
def test_what_is_no_question_about_this_knowledge_is_refused(
    knowledge: KnowledgeBase, text: str, expected: str
) -> None:
    with pytest.raises(QueryError) as caught:
        query(knowledge, text)
    assert expected in str(caught.value)


def test_brackets_in_texts_names_and_comments_do_not_count(knowledge: KnowledgeBase) -> None:
    assert query(knowledge, f"ASK {{ ?x ?y '{'(' * 50}' }} # {'{' * 50}").answer is False


def test_time_and_rows_are_bounded(knowledge: KnowledgeBase, monkeypatch: pytest.MonkeyPatch) -> None:
    every = "{ ?a ?b ?c . ?d ?e ?f . ?g ?h ?i . ?j ?k ?l }"
    with pytest.raises(QueryError, match=r"the query takes longer than 0.2 s: ask for less"):
        query(knowledge, f"SELECT (COUNT(*) AS ?n) {every}", seconds=0.2)
    monkeypatch.setattr(querying, "MAX_ROWS", 10)
    with pytest.raises(QueryError, match="the query has more than 10 rows: give it a LIMIT"):
        query(knowledge, f"SELECT ?a {every}")
    assert len(query(knowledge, f"SELECT ?a {every} LIMIT 10").rows) == 10


def test_equal_questions_have_equal_answers(knowledge: KnowledgeBase) -> None:
    text = "SELECT ?x { ?x a tomasys:QAvalue } LIMIT 5"
    assert query(knowledge, text) == query(knowledge, text)
