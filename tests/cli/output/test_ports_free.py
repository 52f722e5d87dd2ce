"""Addresses and ports of a stack are tried before anything starts."""

from __future__ import annotations

import socket

import pytest

from regraft.cli.system.ports_free import why_not_free


@pytest.mark.parametrize("port", [70_000, -1])
def test_what_is_no_port_is_said_to_be_none(port: int) -> None:
    assert "no such address and port" in (why_not_free("127.0.0.1", port) or "")


def test_a_port_that_another_listens_to_is_not_free() -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        assert why_not_free(*other.getsockname()) == "address already in use"
    assert why_not_free("127.0.0.1", 0) is None
