"""The documentation is true: its Python runs, its stacks load, its files, commands, routes and links exist."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import typer
import yaml

from regraft.bus.memory_bus import MemoryBus, MemoryHub
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import known_types
from regraft.bus_schema.model.adaptation import AdaptationRequest
from regraft.client import Client
from regraft.dashboard_api import app
from regraft.dashboard_api.backend.event_buffer import EventBuffer
from regraft.dashboard_api.backend.manager import Services
from regraft.dashboard_api.http.callers import Callers
from regraft.process.main import load_class
from regraft.security.tokens import Tokens
from regraft.sim_service import devices
from regraft.sim_service.devices.fitting import device_class
from regraft.stack import StackError, load
from tests.cli.app import whole
from tests.schema.strategies import all_types
from tests.waiting import PATIENCE

ROOT = Path(__file__).parents[2]
PAGES = (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md")))
FENCE = re.compile(r"^```(\w*) ?([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FOLDERS = tuple(path.name for path in ROOT.iterdir() if path.is_dir() and not path.name.startswith("."))
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


def in_pages(found: Any) -> list[Any]:
    """Return (page, thing) for everything that ``found`` finds on the pages, as test parameters."""
    pairs = [(page, thing) for page in PAGES for thing in dict.fromkeys(found(page))]
    return [pytest.param(page, thing, id=f"{page.name}: {str(thing)[:60]!r}") for page, thing in pairs]


# --- Python ---


def test_the_python_of_every_page_runs_and_its_tests_pass(tmp_path: Path) -> None:
    modules = []
    for page in PAGES:
        code = "\n\n".join(blocks(page, "python"))
        if code:
            name = "test_" + re.sub(r"\W", "_", page.stem.lower()) + ".py"
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


@pytest.mark.parametrize(("page", "text"), in_pages(lambda page: blocks(page, "yaml")))
def test_stacks_in_the_docs_load(page: Path, text: str, tmp_path: Path) -> None:
    for named in re.findall(r"(?:mission|file): (\w+\.xml)", text):
        (tmp_path / named).write_text("")
    if "system:" in text:
        assert stack_problems(text, tmp_path) == []


def test_errors_shown_are_those_that_come(tmp_path: Path) -> None:
    page = ROOT / "docs" / "stacks.md"
    broken, shown = blocks(page, "yaml", "broken"), blocks(page, "text")
    assert broken
    for text, expected in zip(broken, shown, strict=True):
        assert stack_problems(text, tmp_path) == expected.splitlines()


@pytest.mark.parametrize(("page", "text"), in_pages(lambda page: blocks(page, "yaml", "adaptation")))
def test_adaptations_in_the_docs_are_well_formed(page: Path, text: str) -> None:
    request = codec.from_plain(yaml.safe_load(text), AdaptationRequest)
    assert request.changes


# --- files, modules, types, links ---


def paths_in(page: Path) -> Iterator[str]:
    """Yield everything in back quotes that looks like a path in this project."""
    for span in spans(page):
        if re.fullmatch(r"[\w./-]+", span) and span.split("/")[0] in FOLDERS and "/" in span:
            yield span


def is_type(name: str) -> bool:
    """Tell whether it is the name of a message type."""
    return name in {kind.name for kind in (*known_types(), *all_types())}


def is_topic_or_service(name: str) -> bool:
    """Tell whether it is one of the services that are named after their component's folder."""
    return name in ("adaptation_manager/adapt",)


@pytest.mark.parametrize(("page", "path"), in_pages(paths_in))
def test_every_file_named_exists(page: Path, path: str) -> None:
    assert (ROOT / path).exists() or is_type(path) or is_topic_or_service(path)


def classes_in(page: Path) -> list[str]:
    """Return every ``module:Class`` of a page."""
    return re.findall(r"\b[a-z_]+(?:\.\w+)+:[A-Z]\w+", prose(page))


@pytest.mark.parametrize(("page", "place"), in_pages(classes_in))
def test_every_component_class_named_exists(page: Path, place: str) -> None:
    if place.startswith(f"{devices.__name__}."):
        device_class(place)
    elif place.split(".")[0] in FOLDERS:
        load_class(place)


def anchors(page: Path) -> set[str]:
    """Return the anchors of a page's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", FENCE.sub("", page.read_text()), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize(("page", "target"), in_pages(lambda page: re.findall(r"\]\(([^)\s]+)\)", prose(page))))
def test_every_link_within_the_project_resolves(page: Path, target: str) -> None:
    if target.startswith("https://"):
        return
    name, _, anchor = target.partition("#")
    there = (page.parent / name).resolve() if name else page
    assert there.exists()
    assert not anchor or anchor in anchors(there)


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


@pytest.mark.parametrize(("page", "text"), in_pages(commands_in))
def test_every_command_named_exists(page: Path, text: str) -> None:
    command = command_line()
    words = shlex.split(text)[1:]
    while words and hasattr(command, "commands") and words[0] in command.commands:
        command = command.commands[words.pop(0)]
    # The placeholder COMMAND, or an option of all commands.
    assert command is not command_line() or words[0] == "COMMAND" or words[0].startswith("--")
    if command is not command_line():
        options = {option for parameter in command.params for option in parameter.opts} | {"--help"}
        assert {word.partition("=")[0] for word in words if re.fullmatch(r"--[a-z-]+.*", word)} <= options


@pytest.mark.parametrize(("page", "target"), in_pages(lambda page: re.findall(r"`make ([a-z]+)`", prose(page))))
def test_every_make_target_named_exists(page: Path, target: str) -> None:
    assert re.search(rf"^{target}:", (ROOT / "Makefile").read_text(), re.MULTILINE)


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
