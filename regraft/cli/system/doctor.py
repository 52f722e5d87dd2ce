"""``regraft doctor``: looks for what could keep systems from running on this machine."""

from __future__ import annotations

import ctypes
import importlib.metadata
import os
import platform
import shutil
import socket
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass

import typer

from regraft import run_directory
from regraft.bus.interface import BusError
from regraft.bus.zenoh_bus import open_bus
from regraft.bus.zenoh_config import Endpoints
from regraft.cli.outcomes import FAILED
from regraft.cli.system.ports_free import why_not_free
from regraft.cli.terminal.options import JsonOption
from regraft.cli.terminal.output import show_json, show_table
from regraft.security.system_secret import fresh
from regraft.system.launch import NoPort, free_endpoint

PYTHON = (3, 11)
PACKAGES = (
    "eclipse-zenoh",
    "msgpack",
    "numpy",
    "mujoco-core",
    "PyYAML",
    "typer",
    "rich",
    "fastapi",
    "uvicorn",
)
LIBRARIES = {"EGL": "libEGL.so.1", "OSMesa": "libOSMesa.so.8", "OpenGL": "libOpenGL.so.0"}
GATEWAY = ("127.0.0.1", 8000)
ENOUGH_SPACE = 1024**3
OK, WARNING, PROBLEM = "ok", "warning", "problem"


@dataclass(frozen=True, slots=True)
class Finding:
    """The finding of one check: ``ok``, ``warning`` or ``problem``, and what to do about it."""

    check: str
    level: str
    text: str


def doctor(as_json: JsonOption = False) -> None:
    """Check this machine: Python, bus, graphics, ports, folders, leftovers; exits with 1 for a problem."""
    findings = [finding for check in CHECKS for finding in check()]
    if as_json:
        show_json({"findings": [asdict(finding) for finding in findings]})
    else:
        show_table(("check", "", "found"), ((f.check, f.level, f.text) for f in findings), empty="nothing to check")
    if any(finding.level == PROBLEM for finding in findings):
        raise typer.Exit(FAILED)


def check_python() -> Iterator[Finding]:
    """Check the interpreter."""
    found = sys.version_info[:2]
    text = f"{platform.python_version()} at {sys.executable}"
    if found < PYTHON:
        yield Finding("python", PROBLEM, f"{text}; must be at least {PYTHON[0]}.{PYTHON[1]}")
    else:
        yield Finding("python", OK, text)
    if not sys.platform.startswith("linux"):
        yield Finding("platform", PROBLEM, f"{sys.platform}: hosts need Linux")


def check_packages() -> Iterator[Finding]:
    """List the packages that matter."""
    versions = []
    for package in PACKAGES:
        try:
            versions.append(f"{package} {importlib.metadata.version(package)}")
        except importlib.metadata.PackageNotFoundError:
            versions.append(f"{package} not installed")
    yield Finding("packages", OK, ", ".join(versions))


def check_bus() -> Iterator[Finding]:
    """Open a hub on a loopback port and reach it."""
    secret = fresh()
    try:
        endpoint = free_endpoint()
        hub = open_bus(Endpoints((endpoint,), router=True, secret=secret))
    except (BusError, NoPort) as error:
        yield Finding("bus", PROBLEM, str(error))
        return
    try:
        open_bus(Endpoints(connect=(endpoint,), secret=secret)).close()
        yield Finding("bus", OK, f"a hub at {endpoint} was reached")
    except BusError as error:
        yield Finding("bus", PROBLEM, str(error))
    finally:
        hub.close()


def check_graphics() -> Iterator[Finding]:
    """Report which graphics libraries load; cameras do without, more slowly."""
    loaded = {name: _loads(file) for name, file in LIBRARIES.items()}
    for name, why in loaded.items():
        yield Finding(f"graphics, {name}", WARNING if why else OK, why or f"{LIBRARIES[name]} loads")
    if loaded["EGL"] and loaded["OSMesa"]:
        yield Finding(
            "graphics",
            WARNING,
            "neither EGL nor OSMesa loads: cameras draw with the slow built-in ray camera",
        )
    forced = os.environ.get("REGRAFT_RENDERER") or os.environ.get("MUJOCO_GL")
    if forced:
        yield Finding("graphics", OK, f"the environment asks for {forced}")


def _loads(library: str) -> str:
    try:
        ctypes.CDLL(library)
    except OSError as error:
        return str(error)
    return ""


def check_ports() -> Iterator[Finding]:
    """Check that there are free ports, and that the gateway's usual one is among them."""
    try:
        free_endpoint()
        yield Finding("ports", OK, "loopback ports can be had")
    except NoPort as error:
        yield Finding("ports", PROBLEM, str(error))
    address, port = GATEWAY
    why = why_not_free(address, port)
    text = f"{address}:{port}, the gateway's usual place: "
    yield Finding("ports", WARNING if why else OK, text + (why or "free"))
    if not socket.has_ipv6:
        yield Finding("ports", OK, "no IPv6 on this machine")


def check_home() -> Iterator[Finding]:
    """Check that files can be written where systems keep theirs."""
    home = run_directory.home()
    try:
        home.mkdir(parents=True, exist_ok=True, mode=0o700)
        with tempfile.TemporaryFile(dir=home) as probe:
            probe.write(b"regraft")
        free = shutil.disk_usage(home).free
    except OSError as error:
        yield Finding("home", PROBLEM, f"cannot write to {home}: {error.strerror}; REGRAFT_HOME names another place")
        return
    level = OK if free >= ENOUGH_SPACE else WARNING
    yield Finding("home", level, f"{home} is writable, {free / 1024**3:.1f} GiB free")


def check_leftovers() -> Iterator[Finding]:
    """Look for what systems that died have left behind."""
    try:
        running, known = run_directory.running(), run_directory.known()
    except run_directory.NoRoom as error:
        yield Finding("systems", PROBLEM, str(error))
        return
    names = ", ".join(f"{info.system} (process {info.pid})" for info in running) or "none"
    yield Finding("systems", OK, f"running: {names}")
    for system in known:
        if run_directory.is_running(system):
            continue
        path = run_directory.folder(system) / "run.json"
        text = f"{system} died without a farewell: {path} is left; 'regraft up' under that name replaces it"
        yield Finding("leftovers", WARNING, text)


CHECKS: tuple[Callable[[], Iterator[Finding]], ...] = (
    check_python,
    check_packages,
    check_bus,
    check_graphics,
    check_ports,
    check_home,
    check_leftovers,
)
