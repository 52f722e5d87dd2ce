"""Components and message types come in from other people's packages, by dotted path."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest

from regraft import run_directory
from tests.outside.installing import having, installed_package, regraft, started
from tests.support.waiting import wait_until

pytestmark = pytest.mark.slow

PACKAGE = Path(__file__).parent / "package"


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder in which the package is installed."""
    return installed_package(PACKAGE, tmp_path_factory)


def test_a_component_from_another_package_runs_alone_and_is_seen_by_the_tools(
    installed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    environment = having(installed, tmp_path)
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path))
    words = ("run", "acme_weather.station:Station", "--name", "station")
    command = started(environment, *words, log=tmp_path / "station.log")
    try:
        wait_until(lambda: run_directory.running(), "the component to be up")
        system = run_directory.running()[0].system
        command.must_run()

        def echo() -> subprocess.CompletedProcess[str]:
            return regraft(environment, "--system", system, "topic", "echo", "weather", "--count", "1", "--json")

        seen = echo()
        assert seen.returncode == 0, seen.stderr
        assert "290.0" in seen.stdout
        done = regraft(environment, "--system", system, "param", "set", "station", "temperature=300")
        assert done.returncode == 0, done.stderr
        assert "300.0" in echo().stdout
    finally:
        assert command.end() in (0, 130)


def test_its_message_type_can_be_named_in_a_stack(installed: Path, tmp_path: Path) -> None:
    stack = tmp_path / "stack.yaml"
    stack.write_text(
        "system: weather\nclock: real\nimports: [acme_weather.messages]\n"
        "topics:\n  weather: {type: acme/Weather, rate: 20}\n"
        "components:\n  station: {class: 'acme_weather.station:Station', parameters: {temperature: 280}}\n"
    )
    ended = regraft(having(installed, tmp_path / "home"), "up", str(stack), "--for", "1", "--json", "--headless")
    assert ended.returncode == 0, ended.stderr
    assert json.loads(ended.stdout)["wall_s"] > 0
