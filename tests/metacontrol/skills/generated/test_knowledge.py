"""A file of skills is a knowledge base without files in between: the same as from the generated individuals."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.adaptation_manager.planners.metacontrol.knowledge.errors import KnowledgeError
from regraft.adaptation_manager.planners.metacontrol.knowledge.knowledge_base import KnowledgeBase, base_of, load
from regraft.adaptation_manager.planners.metacontrol.knowledge.owl.imports import ONTOLOGIES, with_imports
from regraft.adaptation_manager.planners.metacontrol.knowledge.view import model_of
from regraft.adaptation_manager.planners.metacontrol.skills.generators.owl import individuals
from regraft.adaptation_manager.planners.metacontrol.skills.knowledge import documents_of, knowledge_of
from regraft.adaptation_manager.planners.metacontrol.skills.reading import LIBRARY, read_skills
from tests.metacontrol.skills.generated.test_complete import LEVELS, THREE_SKILLS, written
from tests.metacontrol.skills.texts import GOOD


def names(knowledge: KnowledgeBase) -> list[str]:
    """Return the names of a knowledge base's files."""
    return [Path(file).name for file in knowledge.files]


def of(folder: Path, text: str, name: str = "cleaner") -> KnowledgeBase:
    """Return the knowledge base of a text of skills."""
    path = folder / f"{name}.skills"
    path.write_text(text)
    return knowledge_of(read_skills(path))


def test_it_has_the_facts_rules_and_model_of_the_files(tmp_path: Path) -> None:
    loaded = load([written(tmp_path, THREE_SKILLS), *LEVELS])
    made = of(tmp_path, THREE_SKILLS)
    assert names(made) == ["cleaner.skills", "mros.owl", "tomasys.owl"]
    assert set(made.facts) == set(loaded.facts)
    assert set(made.rules) == set(loaded.rules)
    assert model_of(made) == model_of(loaded)


def test_the_definitions_of_the_library_bring_the_ontology_of_their_domain(tmp_path: Path) -> None:
    made = knowledge_of(read_skills(LIBRARY / "navigation.skills"))
    assert names(made) == ["navigation.skills", "navigation.owl", "mros.owl", "tomasys.owl"]
    target = tmp_path / "individuals.owl"
    target.write_text(individuals(read_skills(LIBRARY / "navigation.skills")).text)
    assert model_of(made) == model_of(load([target, ONTOLOGIES / "navigation.owl"]))


def test_definitions_of_the_same_name_that_are_not_the_librarys_bring_none(tmp_path: Path) -> None:
    (tmp_path / "navigation_definitions.skills").write_text("Quality speed")
    made = of(tmp_path, f'import "navigation_definitions.skills"\n{GOOD}')
    assert names(made) == ["cleaner.skills", "mros.owl", "tomasys.owl"]


def test_the_order_of_designs_is_that_of_the_text_imported_files_first(tmp_path: Path) -> None:
    (tmp_path / "first.skills").write_text("\n" * 50 + GOOD)
    made = of(tmp_path, f'import "first.skills"\n{GOOD.replace("move", "turn").replace("go", "left")}')
    assert [name.rpartition("#")[2] for name in model_of(made).designs] == ["go", "left"]


def test_problems_name_the_line_of_the_skills(tmp_path: Path) -> None:
    one, other = tmp_path / "one.skills", tmp_path / "other.skills"
    one.write_text("Quality speed { weight: 0.2 }\n" + GOOD)
    other.write_text("\n\nQuality speed { weight: 0.5 }\n\n" + GOOD.replace("speed: 0.5", "speed: 0.7"))
    with pytest.raises(KnowledgeError) as error:
        base_of(with_imports([each for file in (one, other) for each in documents_of(read_skills(file))]))
    found = [(each.file, each.line, each.why.partition(" has one")[0]) for each in error.value.problems]
    assert found == [(str(other), 3, "speed: qa_weight"), (str(other), 6, "qa_speed_go: hasValue")]
    assert all(each.why.endswith(f"(with {one})") for each in error.value.problems)


def test_an_individual_has_the_place_of_the_skills(tmp_path: Path) -> None:
    made = of(tmp_path, f"\n{GOOD}")
    model = model_of(made)
    assert made.place(model.find("design", "go")) == (str(tmp_path / "cleaner.skills"), 3)
    assert made.place(model.find("function", "move")) == (str(tmp_path / "cleaner.skills"), 2)
    assert made.place("http://nowhere#x")[1] == 0
