"""A knowledge base is loaded from files; each that is missing, broken, too large or contradictory is named."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from regraft.adaptation_manager.planners.metacontrol.knowledge.errors import KnowledgeError
from regraft.adaptation_manager.planners.metacontrol.knowledge.knowledge_base import LEVELS, load
from regraft.adaptation_manager.planners.metacontrol.knowledge.owl import documents, scanning
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules import chainer
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.atoms import rule_text
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import fact_text
from tests.metacontrol.owl import HEAD, NAVIGATE, individual, published_designs, quality, rule, write


def problem(*files: Path) -> str:
    """Return what is wrong with files."""
    with pytest.raises(KnowledgeError) as caught:
        load(files)
    return str(caught.value)


def line_of(path: Path, text: str) -> int:
    """Return the first line that has a text."""
    return next(number for number, line in enumerate(path.read_text().splitlines(), start=1) if text in line)


def test_the_shipped_levels_load_without_a_conclusion_of_an_error() -> None:
    knowledge = load(LEVELS)
    assert knowledge.conflicts(knowledge.conclude()) == ()
    names = {each.name for each in knowledge.rules}
    assert names >= {"S1", "S2", "S3", "S4", "S5", "S6", "S9", "S10", "S11", "measured-below", "measured-above"}


def test_the_shipped_levels_are_found_by_what_a_file_imports(tmp_path: Path) -> None:
    alone = load([write(tmp_path, published_designs())])
    listed = load([write(tmp_path, published_designs()), *LEVELS])
    assert [Path(file).name for file in alone.files] == ["app.owl", "navigation.owl", "mros.owl", "tomasys.owl"]
    assert set(alone.facts) == set(listed.facts)
    assert set(alone.rules) == set(listed.rules)


def test_an_import_by_the_address_of_a_published_file_is_found_by_its_name(tmp_path: Path) -> None:
    address = "https://raw.githubusercontent.com/meta-control/mc_mdl_tomasys/ros2/owl/tomasys.owl"
    path = write(tmp_path, imports=(address,))
    assert len(load([path, *LEVELS]).files) == 4
    said = problem(path)
    assert said.startswith(f"{path}:{line_of(path, address)}: imports '{address}', which none of the given files is")


def test_an_import_that_is_missing_is_named_with_the_nearest(tmp_path: Path) -> None:
    path = write(tmp_path, imports=("http://ros/navigaton_domain",))
    assert "(did you mean 'http://ros/navigation_domain'?). Nothing is fetched: add its file" in problem(path)


def test_circular_imports_are_named(tmp_path: Path) -> None:
    one = write(tmp_path, name="one.owl", ontology="http://one", imports=("http://two",))
    two = write(tmp_path, name="two.owl", ontology="http://two", imports=("http://one",))
    assert problem(one, two) == f"{two}:{line_of(two, 'http://one')}: the imports are circular: {one} -> {two} -> {one}"


def test_a_file_that_imports_itself_is_named(tmp_path: Path) -> None:
    assert "the imports are circular" in problem(write(tmp_path, imports=("http://ros/application",)))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", ":1: is not well-formed XML: no element found"),
        (f"{HEAD}<b></a>", ":6: is not well-formed XML: mismatched tag"),
        ("<a/>", ":1: the first element is 'a', must be rdf:RDF"),
        (f'{HEAD}<rdf:Description rdf:about="a" rdf:nodeID="b"/></rdf:RDF>', ": is no RDF/XML: "),
        (f"{HEAD}</rdf:RDF>", ": holds no triples"),
    ],
)
def test_a_file_that_is_no_owl_is_named(tmp_path: Path, text: str, expected: str) -> None:
    path = tmp_path / "broken.owl"
    path.write_text(text)
    assert problem(path).startswith(f"{path}{expected}")


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    assert problem(tmp_path / "none.owl") == f"{tmp_path / 'none.owl'}: cannot be read: No such file or directory"
    assert problem(tmp_path) == f"{tmp_path}: cannot be read: Is a directory"
    assert problem() == "a knowledge base has at least one file"


def test_sizes_are_limited_before_parsing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    deep = tmp_path / "deep.owl"
    deep.write_text(HEAD + "<app:a>\n" * 5000)
    assert problem(deep) == f"{deep}:405: more than 400 elements are inside each other"
    monkeypatch.setattr(documents, "MAX_BYTES", 1000)
    large = write(tmp_path, published_designs())
    assert problem(large) == f"{large}: has more than 1000 bytes"
    monkeypatch.undo()
    monkeypatch.setattr(documents, "MAX_TRIPLES", 10)
    assert "triples, must have at most 10" in problem(large)


LAUGHS = "".join(f'<!ENTITY l{i} "{f"&l{i - 1};" * 10 if i else "ha"}">' for i in range(12))


@pytest.mark.parametrize(
    ("doctype", "body", "expected"),
    [
        (LAUGHS, "&l11;", "the entity 'l1' is refused: at most 200 entities"),
        ('<!ENTITY x SYSTEM "file:///etc/passwd">', "&x;", "the entity 'x' is not in the file itself"),
        ('<!ENTITY % x SYSTEM "http://localhost/x">', "", "the entity 'x' is not in the file itself"),
        (f'<!ENTITY x "{"ha" * 501}">', "&x;", "the entity 'x' is refused"),
        (f'<!ENTITY x "{"ha" * 400}">', "&x;" * 100_000, "its entities expand to more than"),
    ],
)
def test_entities_are_limited_and_never_read_elsewhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, doctype: str, body: str, expected: str
) -> None:
    monkeypatch.setattr(scanning, "MAX_EXPANDED", 2**20)
    path = tmp_path / "laughs.owl"
    inside = HEAD.partition("?>")[2]
    path.write_text(f'<?xml version="1.0"?>\n<!DOCTYPE rdf:RDF [{doctype}]>{inside}<rdfs:comment>{body}</rdfs:comment>')
    assert expected in problem(path)


def test_two_values_of_a_functional_property_are_named_with_individual_and_line(tmp_path: Path) -> None:
    path = write(
        tmp_path,
        individual("other", "tomasys:Function"),
        published_designs(),
        individual("slow", tomasys__solvesF=">other"),
    )
    assert problem(path) == (
        f"{path}:{line_of(path, '#slow')}: slow: solvesF has one value at most:"
        " solvesF(slow, other) given; solvesF(slow, to_navigate) given"
    )


def test_two_values_in_two_files_are_named_with_both(tmp_path: Path) -> None:
    first = write(tmp_path, individual("m", "tomasys:QAvalue", tomasys__hasValue=1))
    second = write(tmp_path, individual("m", tomasys__hasValue=2), name="second.owl", ontology="http://second")
    said = problem(first, second)
    assert said.startswith(f"{second}:{line_of(second, '#m')}: m: hasValue has one value at most")
    assert said.endswith(f"(with {first})")


def test_an_individual_of_two_disjoint_classes_is_named(tmp_path: Path) -> None:
    path = write(tmp_path, individual("thing", "tomasys:Function"), individual("thing", "tomasys:Objective"))
    assert "thing: the classes are disjoint: Function(thing) given; Objective(thing) given" in problem(path)
    path = write(tmp_path, individual("slow", tomasys__solvesF=">nav:battery"))
    assert "battery: the classes are disjoint: Component(battery) given; Function(battery) by range of solvesF" in (
        problem(path)
    )


def test_the_same_individual_by_two_names_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path, individual("a", "tomasys:Function", owl__sameAs=">b"))
    assert "'a': is the same as 'b'; names are unique here: use one of both" in problem(path)


def test_an_individual_without_a_name_is_refused(tmp_path: Path) -> None:
    part = individual("a", "tomasys:Function").replace(' rdf:about="http://ros/application#a"', "")
    assert "is stated of an individual without an IRI; give it one" in problem(write(tmp_path, part))


def test_a_rule_that_contradicts_at_once_is_reported_and_not_refused(tmp_path: Path) -> None:
    path = write(
        tmp_path,
        individual("d", "tomasys:FunctionDesign", tomasys__solvesF=f">{NAVIGATE}", tomasys__fd_realisability=True),
        rule("off", ["tomasys:FunctionDesign ?x"], ["tomasys:fd_realisability ?x false"]),
    )
    knowledge = load([path])
    conclusions = knowledge.conclude()
    assert [each.text(conclusions) for each in knowledge.conflicts(conclusions)] == [
        "d: fd_realisability has one value at most: fd_realisability(d, true) given; fd_realisability(d, false) by off"
    ]


def test_a_rule_without_an_end_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(chainer, "MAX_FACTS", 1000)
    path = write(
        tmp_path,
        individual("a", app__v=0),
        rule("counting", ["app:v ?x ?v", "swrlb:add ?w ?v 1"], ["app:v ?x ?w"]),
        imports=(),
    )
    assert problem(path).startswith(f"{path}: rule 'counting': more than 1000 facts")


def test_rules_that_files_repeat_are_read_once(tmp_path: Path) -> None:
    part = rule("same", ["app:Room ?x"], ["app:Place ?x"])
    files = [write(tmp_path, part, name=f"{i}.owl", ontology=f"http://{i}", imports=()) for i in range(2)]
    assert [rule_text(each) for each in load(files).rules] == ["Room(?x) -> Place(?x)"]


def test_the_order_of_the_files_has_no_influence_on_the_conclusions(tmp_path: Path) -> None:
    files = [write(tmp_path, published_designs(), individual("nav:battery", tomasys__c_status="FALSE")), *LEVELS]
    one, other = load(files).conclude(), load(files[::-1]).conclude()
    assert one.derived() == other.derived()
    assert "fd_realisability(normal, false)" in {fact_text(each) for each in one.derived()}


VALID = "".join((quality("mros:safety", "HIGHER", 1.0), published_designs(), rule("r", ["app:Room ?x"], ["app:P ?x"])))


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_no_damage_to_a_file_is_more_than_an_error(tmp_path: Path, data: st.DataObject) -> None:
    text = write(tmp_path, VALID, imports=()).read_bytes()
    for _ in range(data.draw(st.integers(1, 3))):
        place = data.draw(st.integers(0, len(text)))
        cut = data.draw(st.integers(0, 40))
        text = text[:place] + data.draw(st.binary(max_size=8)) + text[place + cut :]
    path = tmp_path / "damaged.owl"
    path.write_bytes(text)
    try:
        load([path])
    except KnowledgeError as error:
        assert str(path) in str(error)
