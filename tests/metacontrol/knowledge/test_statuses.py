"""Published files mix vocabularies of statuses: they become one, and anything else is refused (B8)."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.adaptation_manager.planners.metacontrol.knowledge import vocabulary
from regraft.adaptation_manager.planners.metacontrol.knowledge.errors import KnowledgeError
from regraft.adaptation_manager.planners.metacontrol.knowledge.knowledge_base import load
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import fact_text
from regraft.adaptation_manager.planners.metacontrol.knowledge.statuses import ComponentStatus
from regraft.adaptation_manager.planners.metacontrol.knowledge.view import model_of
from tests.metacontrol.owl import individual, rule, write


@pytest.mark.parametrize(
    ("given", "status"),
    [
        (False, ComponentStatus.FAILED),
        ("FALSE", ComponentStatus.FAILED),
        (True, ComponentStatus.AVAILABLE),
        ("TRUE", ComponentStatus.AVAILABLE),
        ("RECOVERED", ComponentStatus.RECOVERED),
    ],
)
def test_the_status_of_a_component_has_one_type(tmp_path: Path, given: object, status: ComponentStatus) -> None:
    knowledge = load([write(tmp_path, individual("c", "tomasys:Component", tomasys__c_status=given))])
    assert model_of(knowledge).components["http://ros/application#c"] is status


@pytest.mark.parametrize(
    ("given", "expected"),
    [("INTERNAL_ERROR", "IN_ERROR_FR"), ("EXTERNAL_ERROR", "IN_ERROR_FR"), ("IN_ERROR_NFR", "IN_ERROR_NFR")],
)
def test_statuses_of_tomasys_become_those_of_mros(tmp_path: Path, given: str, expected: str) -> None:
    knowledge = load([write(tmp_path, individual("o", "tomasys:Objective", tomasys__o_status=given))])
    (fact,) = knowledge.conclude().of(vocabulary.O_STATUS)
    assert fact_text(fact) == f'o_status(o, "{expected}")'


def test_statuses_in_rules_are_translated_too(tmp_path: Path) -> None:
    path = write(
        tmp_path,
        individual("c", "tomasys:Component", tomasys__c_status="FALSE"),
        individual("fg", "tomasys:FunctionGrounding"),
        rule(
            "boolean",
            ["tomasys:c_status ?x false", "tomasys:FunctionGrounding ?y"],
            ['tomasys:fg_status ?y "INTERNAL_ERROR"', 'tomasys:o_status app:o "UPDATABLE"'],
        ),
    )
    conclusions = load([path]).conclude()
    assert [fact_text(each) for each in conclusions.of(vocabulary.FG_STATUS)] == ['fg_status(fg, "IN_ERROR_FR")']
    assert [fact_text(each) for each in conclusions.of(vocabulary.UPDATABLE)] == ["o_updatable(o, true)"]


@pytest.mark.parametrize(
    ("statement", "expected"),
    [
        ({"tomasys__c_status": "FASLE"}, 'c_status is "FASLE"; did you mean \'"FALSE"\'?'),
        ({"tomasys__c_status": 0}, "c_status is 0.0; there are: "),
        ({"tomasys__o_status": "BROKEN"}, 'o_status is "BROKEN"; '),
        ({"tomasys__fd_realisability": "maybe"}, 'fd_realisability is "maybe"; '),
        ({"tomasys__hasValue": "high"}, 'hasValue is "high", must be a number'),
        ({"tomasys__hasValue": True}, "hasValue is true, must be a number"),
        ({"mros__qa_direction": "UP"}, 'qa_direction is "UP"; '),
        ({"mros__fd_context": 3}, "fd_context is 3.0, must be a text"),
    ],
)
def test_any_other_value_is_refused_with_what_may_be(
    tmp_path: Path, statement: dict[str, object], expected: str
) -> None:
    path = write(tmp_path, individual("thing", **statement), imports=())
    with pytest.raises(KnowledgeError) as caught:
        load([path])
    assert str(caught.value).startswith(f"{path}:8: 'thing': {expected}")


def test_a_status_that_a_rule_must_not_have_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path, rule("wrong", ['tomasys:c_status ?x "gone"'], ["app:Gone ?x"]), imports=())
    with pytest.raises(KnowledgeError, match=r"""rule 'wrong': c_status is "gone"; there are: """):
        load([path])


def test_a_number_that_is_none_is_refused(tmp_path: Path) -> None:
    wrong = individual("v", tomasys__hasValue=1).replace(">1<", ">one<")
    path = write(tmp_path, wrong, imports=())
    with pytest.raises(KnowledgeError, match=r"'v': the value 'one' is no decimal"):
        load([path])


def test_all_that_is_wrong_is_reported_at_once(tmp_path: Path) -> None:
    path = write(
        tmp_path,
        individual("a", tomasys__hasValue="x"),
        individual("b", tomasys__c_status="y"),
        rule("r", ["app:A ?x"], ["app:p ?x ?y"]),
        imports=(),
    )
    with pytest.raises(KnowledgeError) as caught:
        load([path])
    assert len(caught.value.problems) == 3


def test_the_published_operator_of_a_violation_becomes_a_direction(tmp_path: Path) -> None:
    parts = (
        individual("visibility", "tomasys:QualityAttributeType", tomasys__qa_comparison_operator="<"),
        individual("delay", "tomasys:QualityAttributeType", tomasys__qa_comparison_operator=">"),
    )
    qualities = model_of(load([write(tmp_path, *parts)])).qualities
    assert qualities["http://ros/application#visibility"].direction == "HIGHER"
    assert qualities["http://ros/application#delay"].direction == "LOWER"
