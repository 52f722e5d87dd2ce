"""The documentation is true: its Python runs, its stacks load, its files, commands, routes and links exist."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import typer
import yaml
from typer.testing import CliRunner

from regraft.adaptation_manager.planners.choices.estimates import ClassEstimates
from regraft.adaptation_manager.planners.choices.solvers.branch_and_bound import BranchAndBound
from regraft.adaptation_manager.planners.decisions.checking import check_in
from regraft.adaptation_manager.planners.decisions.question import question_of
from regraft.adaptation_manager.planners.decisions.reading import locations_in, read_decision
from regraft.bus.memory_bus import MemoryBus, MemoryHub
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import known_types
from regraft.bus_schema.messages.protocol.host import DescribedComponent
from regraft.bus_schema.model.adaptation import AdaptationRequest
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.consistency import violations
from regraft.bus_schema.model.watch_checks import watch_violations
from regraft.cli.adaptation.mistakes import mistakes
from regraft.cli.stack.resolved import resolved
from regraft.cli.stack.yaml_text import yaml_text
from regraft.cli.topology import Topology
from regraft.client import Client
from regraft.dashboard_api import app
from regraft.dashboard_api.backend.event_buffer import EventBuffer
from regraft.dashboard_api.backend.manager import Services
from regraft.dashboard_api.http.authentication import Callers
from regraft.estimation.changes import changed
from regraft.process.main import load_class
from regraft.security.tokens import Tokens
from regraft.services.bt_executor.node_types import NODE_TYPES
from regraft.sim_service import devices
from regraft.sim_service.devices.core.fitting import device_class
from regraft.stack import StackError, apply_parameter_files, load
from regraft.stack.classes import describe_class
from tests.cli.app import whole
from tests.schema.strategies import all_types
from tests.support.paths import ROOT
from tests.support.tables import check_each
from tests.support.waiting import PATIENCE

PAGES = (
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "behavior_tree/README.md")),
    *sorted((ROOT / "docs").rglob("*.md")),
)
FENCE = re.compile(r"^```(\w*) ?([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
BUILT = ("build", "dist")
FOLDERS = tuple(
    path.name for path in ROOT.iterdir() if path.is_dir() and not path.name.startswith(".") and path.name not in BUILT
)
"""What a path in this project begins with."""


def blocks(page: Path, language: str, mark: str = "") -> list[str]:
    """Return the fenced blocks of a page in a language, with a mark behind the language."""
    return [body for found, given, body in FENCE.findall(page.read_text()) if (found, given) == (language, mark)]


def prose(page: Path) -> str:
    """Return a page without its fenced blocks."""
    return FENCE.sub("", page.read_text())


def spans(page: Path) -> list[str]:
    """Return what stands in back quotes in the prose of a page."""
    return re.findall(r"`([^`\n]+)`", prose(page))


def check_all(found: Callable[[Path], Iterable[str]], check: Callable[[Path, str], object]) -> None:
    """Check everything that ``found`` finds on the pages; fails with all that is wrong."""
    pairs = [(page, thing) for page in PAGES for thing in dict.fromkeys(found(page))]
    check_each(pairs, lambda pair: check(*pair), lambda pair: f"{pair[0].name}: {pair[1]!r}")


# --- Python ---


def test_the_python_of_every_page_runs_and_its_tests_pass(tmp_path: Path) -> None:
    modules = []
    for page in PAGES:
        code = "\n\n".join(blocks(page, "python"))
        if code:
            place = page.relative_to(ROOT).with_suffix("").as_posix()
            name = "test_" + re.sub(r"\W", "_", place.lower()) + ".py"
            (tmp_path / name).write_text(code + "\n\ndef test_it_can_be_imported() -> None:\n    pass\n")
            modules.append(name)
    assert len(modules) >= 3
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-W", "error", "--rootdir", "."]
    done = subprocess.run(
        [*command, *modules],
        cwd=tmp_path,
        env={"PYTHONPATH": str(ROOT), "PATH": "/usr/bin:/bin"},
        capture_output=True,
        text=True,
        timeout=4 * PATIENCE,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


# --- stacks and adaptations ---


def stack_problems(text: str, folder: Path) -> list[str]:
    """Return what is wrong with a stack file, as it is shown."""
    file = folder / "stack.yaml"
    file.write_text(text)
    try:
        load(file)
    except StackError as error:
        return str(error).replace(f"{folder}/", "").splitlines()
    return []


def test_stacks_in_the_docs_load(tmp_path: Path) -> None:
    def loads(_: Path, text: str) -> None:
        for named in re.findall(r"(?:mission|file|world): (\w+\.xml)", text):
            (tmp_path / named).write_text("")
        if "system:" in text:
            assert stack_problems(text, tmp_path) == []

    check_all(lambda page: blocks(page, "yaml"), loads)


def test_errors_shown_are_those_that_come(tmp_path: Path) -> None:
    page = ROOT / "docs" / "stacks.md"
    broken, shown = blocks(page, "yaml", "broken"), blocks(page, "text")
    assert broken
    for text, expected in zip(broken, shown, strict=True):
        assert stack_problems(text, tmp_path) == expected.splitlines()


def test_the_examples_of_several_files_load_and_show_what_they_say(tmp_path: Path) -> None:
    page = ROOT / "docs" / "stacks.md"
    files = {mark: body for language, mark, body in FENCE.findall(page.read_text()) if mark.endswith(".yaml")}
    assert files.keys() == {"base.yaml", "slow.yaml", "rover/robot.yaml", "fleet.yaml", "outdoors.yaml"}
    (tmp_path / "rover").mkdir()
    for model in ("room.xml", "rover/rover.xml"):
        (tmp_path / model).touch()
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    assert set(load(tmp_path / "slow.yaml").architecture.components) == {"wheels", "pilot", "horn"}
    fleet = apply_parameter_files(load(tmp_path / "fleet.yaml"), [tmp_path / "outdoors.yaml"]).architecture
    assert fleet.components["rescuer.wheels"].parameters["radius"] == 0.06
    assert fleet.components["rescuer.wheels"].connections["wind"] == "wind"
    shown = yaml_text(resolved(load(tmp_path / "slow.yaml"))).replace(f"{tmp_path}/", "").splitlines()
    (console,) = [body for body in blocks(page, "console") if "stack show" in body]
    said = [line for line in console.splitlines() if "#" in line or line.endswith(":")]
    assert said == shown[: len(said)]


def described(spec: ComponentSpec) -> DescribedComponent:
    """Return a spec with its class's description, as a host would."""
    description, problems = describe_class(spec.cls, spec.parameters)
    assert not problems
    return DescribedComponent(replace(spec, description=description))


def test_adaptations_in_the_docs_are_possible_in_frog() -> None:
    frog = load(ROOT / "regraft" / "stacks" / "frog" / "stack.yaml").architecture.with_hosts(("edge",))
    known = Topology(dict(frog.components), {}, frog.topics, frozenset(frog.hosts), frog.modes)

    def is_possible(_: Path, text: str) -> None:
        request = codec.from_plain(yaml.safe_load(text), AdaptationRequest)
        assert request.changes
        assert list(mistakes(request.changes, known, described)) == []
        after = changed(frog, request.changes, lambda spec: described(spec).spec)
        assert set(violations(after)) <= set(violations(frog))
        assert list(watch_violations(request.watch, request.confirm, after.components)) == []
        # FROG's mission has no requirement; those of its rounds are in another stack.
        assert [each.requirement for each in request.watch if each.requirement] == []

    check_all(lambda page: blocks(page, "yaml", "adaptation"), is_possible)


def test_decisions_in_the_docs_can_be_taken(tmp_path: Path) -> None:
    architecture = load(ROOT / "regraft" / "stacks" / "frog" / "decided.yaml").architecture

    def can_be_taken(_: Path, text: str) -> None:
        file = tmp_path / "look.yaml"
        file.write_text(text)
        decision, report = read_decision(file), locations_in(file)
        check_in(decision, architecture, ClassEstimates(architecture), report)
        report.raise_if_any()
        context = {"darkness": 0.2, "charge": 0.9}
        choice = question_of(decision, context, ClassEstimates(architecture)).choose(architecture, BranchAndBound())
        assert choice.option is not None, choice.explanation.nothing

    check_all(lambda page: blocks(page, "yaml", "decision"), can_be_taken)


def test_what_decision_commands_show_on_a_page_is_what_they_show(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    for console in blocks(ROOT / "docs" / "decision-files.md", "console"):
        command, *shown = console.splitlines()
        done = CliRunner().invoke(whole(), command.split()[2:])
        said = [re.sub(r"[\d.]+ ms", "ms", line) for line in done.output.splitlines()]
        assert [line for line in shown if line != "..." and re.sub(r"[\d.]+ ms", "ms", line) not in said] == []


# --- files, modules, types, links ---


def paths_in(page: Path) -> Iterator[str]:
    """Yield everything in back quotes that looks like a path in this project."""
    for span in spans(page):
        if re.fullmatch(r"[\w./-]+", span) and span.split("/")[0] in FOLDERS and "/" in span:
            yield span


def is_topic_or_service(name: str) -> bool:
    """Tell whether it is one of the services that are named after their component's folder."""
    return name in ("adaptation_manager/adapt",)


def test_every_file_named_exists() -> None:
    types = {kind.name for kind in (*known_types(), *all_types())}

    def exists(_: Path, path: str) -> None:
        assert (ROOT / path).exists() or path in types or is_topic_or_service(path)

    check_all(paths_in, exists)


def classes_in(page: Path) -> list[str]:
    """Return every ``module:Class`` of a page."""
    return re.findall(r"\b[a-z_]+(?:\.\w+)+:[A-Z]\w+", prose(page))


def is_class(_: Path, place: str) -> bool:
    if place.startswith(f"{devices.__name__}."):
        return bool(device_class(place))
    return place.split(".")[0] not in FOLDERS or bool(load_class(place))


def test_every_component_class_named_exists() -> None:
    check_all(classes_in, is_class)


def anchors(page: Path) -> set[str]:
    """Return the anchors of a page's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", FENCE.sub("", page.read_text()), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def resolves(page: Path, target: str) -> None:
    """Check a link of a page."""
    if target.startswith("https://"):
        return
    name, _, anchor = target.partition("#")
    there = (page.parent / name).resolve() if name else page
    assert there.exists()
    assert not anchor or anchor in anchors(there)


def test_every_link_within_the_project_resolves() -> None:
    check_all(lambda page: re.findall(r"\]\(([^)\s]+)\)", prose(page)), resolves)


def test_every_leaf_of_ours_is_on_the_page_of_missions_or_of_adaptation() -> None:
    named = {span for page in ("missions.md", "adapting.md") for span in spans(ROOT / "docs" / page)}
    assert NODE_TYPES.keys() - named == set()


# --- commands ---


@cache
def command_line() -> Any:
    """Return the command line."""
    return typer.main.get_command(whole())


def commands_in(page: Path) -> Iterator[str]:
    """Yield the regraft commands on a page: in back quotes, and behind a prompt."""
    for body in blocks(page, "console"):
        for line in re.findall(r"^\$ (regraft .*)$", body, re.MULTILINE):
            yield line.split("  #")[0].rstrip(" \\")
    for span in spans(page):
        if span.startswith("regraft "):
            yield span


def is_a_command(_: Path, text: str) -> None:
    """Check the words and options of a command."""
    command = command_line()
    words = shlex.split(text)[1:]
    while words and hasattr(command, "commands") and words[0] in command.commands:
        command = command.commands[words.pop(0)]
    if words and getattr(command, "default", None):
        command = command.commands[command.default]
    # The placeholder COMMAND, or an option of all commands.
    assert command is not command_line() or words[0] == "COMMAND" or words[0].startswith("--")
    if command is not command_line():
        options = {option for parameter in command.params for option in parameter.opts} | {"--help"}
        assert {word.partition("=")[0] for word in words if re.fullmatch(r"--[a-z-]+.*", word)} <= options


def test_every_command_named_exists() -> None:
    check_all(commands_in, is_a_command)


def test_every_make_target_named_exists() -> None:
    def exists(_: Path, target: str) -> None:
        assert re.search(rf"^{target}:", (ROOT / "Makefile").read_text(), re.MULTILINE)

    check_all(lambda page: re.findall(r"`make ([a-z]+)`", prose(page)), exists)


# --- routes ---


def routes_in(page: Path) -> list[str]:
    """Return the routes named on a page: ``GET /architecture``."""
    named = [span for span in spans(page) if re.fullmatch(r"(GET|POST|PATCH|PUT|DELETE) /\S+", span)]
    return [route.partition("?")[0] for route in named]


@pytest.fixture
def served() -> Iterator[set[str]]:
    """Give every route of the gateway."""
    bus = MemoryBus(MemoryHub())
    client = Client(bus, "docs", "docs-1")
    paths = app.build(Services(client, 1.0, 1.0), EventBuffer(), Callers(Tokens(ROOT)), "127.0.0.1").openapi()["paths"]
    yield {f"{method.upper()} {path.removeprefix(app.PREFIX)}" for path, item in paths.items() for method in item}
    client.close()
    bus.close()


def test_every_route_named_exists_and_every_route_is_named(served: set[str]) -> None:
    named = {route for page in PAGES for route in routes_in(page)}
    assert named <= served | {"GET /openapi.json", "GET /openapi.html"}
    told = prose(ROOT / "docs" / "adaptation.md")
    assert [route for route in sorted(served - named) if route.split("/")[-1] not in told] == []
