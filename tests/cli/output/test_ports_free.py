"""Addresses and ports of a stack are tried before anything starts."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from regraft import Component, Parameter
from regraft.cli.outcomes import BadInput
from regraft.cli.system.ports_free import check_ports, why_not_free
from regraft.stack import load


class Wheels(Component):
    """Wheels whose driver connects to a controller."""

    address = Parameter("127.0.0.1", "of the controller", read_only=True)
    port = Parameter(502, "of the controller", minimum=1, maximum=65535, read_only=True)


class Server(Wheels):
    """A component that others connect to."""

    listens_at_port = True


@pytest.fixture
def taken() -> Iterator[int]:
    """Return a port that another process listens to."""
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        yield other.getsockname()[1]


@pytest.mark.parametrize("port", [70_000, -1])
def test_what_is_no_port_is_said_to_be_none(port: int) -> None:
    assert "no such address and port" in (why_not_free("127.0.0.1", port) or "")


def test_a_port_that_another_listens_to_is_not_free(taken: int) -> None:
    assert why_not_free("127.0.0.1", taken) == "address already in use"
    assert why_not_free("127.0.0.1", 0) is None


def checked(folder: Path, what: str, port: int) -> None:
    """Check the ports of a stack of one component."""
    file = folder / "stack.yaml"
    parameters = f"{{address: 127.0.0.1, port: {port}}}"
    file.write_text(f"system: tiny\ncomponents:\n  one: {{{what}, parameters: {parameters}}}\n")
    check_ports(load(file).architecture)


def test_only_a_component_that_listens_needs_its_port_free(taken: int, tmp_path: Path) -> None:
    checked(tmp_path, f"class: '{__name__}:Wheels'", taken)
    checked(tmp_path, "command: [sh, -c, exit]", taken)
    for cls in (f"{__name__}:Server", "regraft.dashboard_api.gateway:Gateway"):
        with pytest.raises(BadInput, match=f"one cannot listen on 127.0.0.1:{taken}: address already in use"):
            checked(tmp_path, f"class: '{cls}'", taken)
