"""A mode may set files in the folder of the running system, as a component's own parameters may."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft import run_directory
from regraft.bus_schema.messages.management.modes import MODES, ModesRequest, SystemModes
from regraft.bus_schema.model.adaptation import ADAPT, AdaptationReport, AdaptationRequest, EnterMode, Outcome
from tests.support.systems import System, all_ended, home
from tests.support.waiting import PATIENCE

pytestmark = pytest.mark.slow

STACK = """\
system: tests
clock: real
imports: [tests.stack.parts]
topics:
  adaptations: {type: regraft/AdaptationReport}
  architecture: {type: regraft/Architecture}
components:
  signals: {class: 'tests.stack.parts:Signals', parameters: {horn: $RUN/quiet.wav}}
  adaptation_manager: {class: 'regraft.adaptation_manager.manager:AdaptationManager'}
modes:
  quiet: [{change: set_parameters, component: signals, parameters: {horn: $RUN/quiet.wav}}]
  loud: [{change: set_parameters, component: signals, parameters: {horn: $RUN/loud.wav}}]
"""


def test_a_file_that_a_mode_sets_in_the_run_folder_is_that_of_the_system(tmp_path: Path) -> None:
    (tmp_path / "stack.yaml").write_text(STACK)
    with home(tmp_path / "home"), all_ended() as systems:
        system = System(tmp_path)
        systems.append(system)
        folder = run_directory.folder("tests")

        def actual() -> str:
            found = system.client.call(MODES, ModesRequest(), SystemModes, PATIENCE).part("")
            assert found is not None
            return found.actual

        system.wait_running("signals")
        assert actual() == "quiet"
        report = system.client.call(ADAPT, AdaptationRequest((EnterMode("loud"),)), AdaptationReport, PATIENCE)
        assert report.outcome is Outcome.APPLIED
        assert system.client.view("signals").parameters["horn"] == str(folder / "loud.wav")
        assert actual() == "loud"
