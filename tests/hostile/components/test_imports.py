"""Modules whose import does what it likes: a command says so in one line, exits with 2, and leaves nothing running."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from regraft import run_directory
from tests.hostile.conftest import HEAD, SOURCE
from tests.support.commands import run
from tests.support.machine.processes import children_of, exists, wait_gone
from tests.support.paths import ROOT
from tests.support.systems import home
from tests.support.waiting import PATIENCE, wait_for, wait_until

pytestmark = pytest.mark.slow

Write = Callable[..., Path]

CLASS = """
from regraft import Component

class Part(Component):
    pass
"""
COMPONENT = "  x: {class: 'hostile_part:Part'}\n"
PLACE = "stack.yaml:9: components.x.class: 'hostile_part:Part': "
IMPORTING = "importing 'hostile_part' "

HOSTILE = {
    "ends the process": ("import os; os._exit(0)", "ends the process: exit code 0"),
    "exits": ("import sys; sys.exit('enough')", "failed: SystemExit: enough"),
    "raises its own": ("class Stop(BaseException): pass\nraise Stop('not\\ntoday')", "failed: Stop: not today"),
    "raises an interrupt": ("raise KeyboardInterrupt", "failed: KeyboardInterrupt"),
    "raises what has no text": (
        "class Mute(Exception):\n    def __str__(self): raise ValueError\nraise Mute",
        "failed: Mute: ",
    ),
    "crashes": ("import ctypes; ctypes.string_at(0)", "ends the process: killed by SIGSEGV"),
    "kills itself": ("import os; os.kill(os.getpid(), 9)", "ends the process: killed by SIGKILL"),
    "leaves a thread": (
        "import threading, time; threading.Thread(target=time.sleep, args=(1000,), name='stays').start()",
        "leaves a thread running that is no daemon, 'stays'",
    ),
    "becomes a daemon": (
        "import os, time\nif os.fork(): os._exit(0)\nos.setsid(); time.sleep(1000)",
        "ends the process: exit code 0",
    ),
    "forks": ("import os; os.fork()", "forks the process"),
    "forks twice": ("import os, time\nif os.fork() == 0:\n    os.setsid(); os.fork()", "forks the process"),
    "closes its output": ("import os; os.close(1)", "closes the file descriptor 1"),
    "closes all": ("import os; os.closerange(0, 1000)", "closes the file descriptor 0"),
    "replaces its output": ("import io, sys; sys.stdout = io.StringIO()", "replaces sys.stdout"),
    "changes the folder": ("import os; os.chdir('/')", "changes the working directory to '/'"),
    "ignores interrupts": ("import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)", "takes SIGINT"),
    "blocks signals": (
        "import signal; signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGTERM])",
        "blocks or unblocks SIGTERM",
    ),
    "sets an alarm": ("import signal; signal.alarm(1000)", "leaves an alarm"),
}
AT_EXIT = "import atexit, os; atexit.register(os._exit, 0)"
HANGS = "import time; time.sleep(1000)"
HANGS_WITH_COPY = "import os, time\nos.fork() or os.setsid()\n" + HANGS
HANGS_AT_EXIT = "import atexit, time; atexit.register(time.sleep, 1000)"

IMPATIENT = """
import regraft.process.trial.trial_import as trial
trial.IMPORT_TIMEOUT, trial.TELL_TIMEOUT = 0.2, 0.05
from regraft.cli.main import main
main()
"""


def command(
    folder: Path, *words: str, program: tuple[str, ...] = ("-m", "regraft.cli")
) -> subprocess.CompletedProcess[str]:
    """Run a command in a folder to its end."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    environment.pop("PYTHONUNBUFFERED", None)  # what is printed is kept for a while, as it is for users
    return run(*words, cwd=folder, environment=environment, program=(sys.executable, *program))


def refused(done: subprocess.CompletedProcess[str], *said: str) -> None:
    """Check that a command ended with one line that says why."""
    assert done.returncode == 2, done
    assert "Traceback" not in done.stderr
    for text in said:
        assert text in done.stderr
    assert not done.stdout
    assert not run_directory.running()


@pytest.fixture
def part(stack: Write) -> Callable[[str], Path]:
    """Return what writes a stack with a component whose module begins with a text; returns its folder."""

    def write(text: str) -> Path:
        file = stack(COMPONENT)
        (file.parent / "hostile_part.py").write_text(f"{text}\n{CLASS}")
        return file.parent

    return write


@pytest.fixture(scope="module")
def complaints(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Return the lines by which a stack is refused that has a component of each hostile module."""
    folder = tmp_path_factory.mktemp("hostile")
    components = "".join(f"  x{number}: {{class: 'hostile_{number}:Part'}}\n" for number in range(len(HOSTILE)))
    (folder / "stack.yaml").write_text(HEAD + components)
    for number, (text, _) in enumerate(HOSTILE.values()):
        (folder / f"hostile_{number}.py").write_text(f"{text}\n{CLASS}")
    with home(folder / "home"):
        done = command(folder, "up", ".", "--headless")
        refused(done)
    return [line for line in done.stderr.splitlines() if "takes long" not in line]


@pytest.mark.parametrize("what", HOSTILE)
def test_a_module_that_does_what_no_import_may_is_refused_in_one_line(complaints: list[str], what: str) -> None:
    number, (_, said) = list(HOSTILE).index(what), HOSTILE[what]
    place = f"stack.yaml:{9 + number}: components.x{number}.class: 'hostile_{number}:Part': "
    (line,) = [line for line in complaints if f"hostile_{number}'" in line or f"hostile_{number}:" in line]
    assert f"{place}importing 'hostile_{number}' {said}" in line
    assert len(complaints) == len(HOSTILE)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (HANGS, f"{PLACE}{IMPORTING}has not ended within 0.2 s"),
        (HANGS_AT_EXIT, f"{PLACE}what 'hostile_part' registers with atexit has not ended within 0.2 s"),
    ],
)
def test_an_import_that_takes_too_long_is_told_of_and_then_refused(
    part: Callable[[str], Path], text: str, said: str
) -> None:
    done = command(part(text), "up", ".", "--headless", program=("-c", IMPATIENT))
    refused(done, said, "importing 'hostile_part' takes long")


def test_what_runs_at_exit_cannot_end_a_command_with_a_code_of_its_own(part: Callable[[str], Path]) -> None:
    done = command(part(AT_EXIT), "up", ".")
    refused(done, "registers with atexit ends the process: exit code 0")
    assert done.stderr.count("\n") == 1


def test_every_module_that_cannot_be_imported_is_told(stack: Write) -> None:
    file = stack(COMPONENT + "  y: {class: 'other_part:Part'}\n" + SOURCE.replace("Source", "Nope"))
    (file.parent / "hostile_part.py").write_text("import os; os._exit(3)")
    (file.parent / "other_part.py").write_text("import hostile_part")
    done = command(file.parent, "up", ".", "--headless")
    refused(done, PLACE, "components.y.class: 'other_part:Part': importing 'other_part' ends the process: exit code 3")
    assert "has no class 'Nope'" in done.stderr


def test_a_module_that_prints_daemonises_a_helper_and_threads_a_while_is_imported(part: Callable[[str], Path]) -> None:
    harmless = """
import os, subprocess, threading, time
print("hello")
subprocess.run(["true"], check=True)
threading.Thread(target=time.sleep, args=(0.05,)).start()
threading.Thread(target=time.sleep, args=(1000,), daemon=True).start()
if os.fork() == 0:
    os.setsid()
    time.sleep(1000)
    os._exit(0)
"""
    folder = part(harmless)
    done = command(folder, "up", ".", "--headless", "--for", "0.1")
    assert done.returncode == 0, done
    assert done.stdout.count("hello") == 1


@pytest.mark.parametrize("redirected", [">&-", ">/dev/full"])
def test_a_module_that_prints_harms_no_system_whose_output_cannot_be_written(
    part: Callable[[str], Path], redirected: str
) -> None:
    folder = part("print('hello')")
    up = f"unset PYTHONUNBUFFERED; exec {sys.executable} -m regraft.cli up . --headless --for 0.5 {redirected}"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        ["sh", "-c", up], cwd=folder, env=environment, capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "the system runs on, unseen" in done.stderr


@pytest.mark.parametrize("signum", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_a_command_that_waits_for_an_import_and_all_that_it_has_forked(
    part: Callable[[str], Path], signum: signal.Signals
) -> None:
    folder = part(HANGS_WITH_COPY)
    process = subprocess.Popen(
        [sys.executable, "-m", "regraft.cli", "up", ".", "--headless"],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdin=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        preexec_fn=lambda: signal.signal(signum, signal.SIG_DFL),  # nohup, for one, has it ignored
    )
    try:
        below = wait_for(lambda: _at_least_two(process.pid), "the copy")
        process.send_signal(signum)
        _, said = process.communicate(timeout=PATIENCE)
    finally:
        process.kill()
        process.wait()
    assert process.returncode == 130, said
    assert b"Traceback" not in said
    wait_gone(below)


def _at_least_two(pid: int) -> list[int] | None:
    found = [child for child in children_of(pid) if exists(child)]
    return found if len(found) >= 2 else None


@pytest.mark.parametrize(
    "words",
    [
        ("run", "hostile_part:Part"),
        ("estimate", "hostile_part:Part"),
        ("types", "--import", "hostile_part"),
        ("mission", "check", "hostile_part.py", "--nodes", "hostile_part:Part"),
        ("evaluate", "hostile_part:STUDY"),
    ],
    ids=lambda words: words[0],
)
@pytest.mark.parametrize("what", ["ends the process", "leaves a thread"])
def test_commands_without_a_stack_refuse_such_a_module_too(
    part: Callable[[str], Path], words: tuple[str, ...], what: str
) -> None:
    text, said = HOSTILE[what]
    refused(command(part(text), *words), IMPORTING + said)


def test_the_module_is_imported_by_its_trial_alone_when_it_is_refused(part: Callable[[str], Path]) -> None:
    folder = part("open('imported', 'a').write('x')\nraise RuntimeError('not today')")
    refused(command(folder, "up", "."), "not today")
    assert (folder / "imported").read_text() == "x"
    wait_until(lambda: not run_directory.running(), "the lock to be free")
