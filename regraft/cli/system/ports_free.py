"""Sees to it, before anything is started, that the ports that components will listen on are free."""

from __future__ import annotations

import socket
from collections.abc import Iterator

from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.hosts.hosts import LOCAL
from regraft.bus_schema.model.parameter_values import effective_parameter
from regraft.cli.outcomes import BadInput
from regraft.process.main import load_class


def check_ports(architecture: Architecture) -> None:
    """Raise BadInput, naming component and address, if the address and port at which one will listen are in use."""
    problems = []
    for component, address, port in listeners(architecture):
        why = why_not_free(address, port)
        if why:
            problems.append(
                f"{component} cannot listen on {address}:{port}: {why}; "
                f"end what uses it, or choose another with --set {component}.port=PORT (0: any free one)"
            )
    if problems:
        raise BadInput("; ".join(problems))


def listeners(architecture: Architecture) -> Iterator[tuple[str, str, int]]:
    """Yield component, address and port of all that will listen here; port 0, any free one, is left out."""
    for name, spec in sorted(architecture.components.items()):
        if spec.description is None or spec.host != LOCAL:
            continue
        if not spec.cls or not load_class(spec.cls).listens_at_port:
            continue
        address = effective_parameter(spec.description, spec.parameters, "address")
        port = effective_parameter(spec.description, spec.parameters, "port")
        if isinstance(address, str) and isinstance(port, int) and port:
            yield name, address, port


def why_not_free(address: str, port: int) -> str | None:
    """Return why nobody can listen there now, None if one can."""
    family = socket.AF_INET6 if ":" in address else socket.AF_INET
    with socket.socket(family) as probe:
        # A connection that has just ended is no reason not to listen again.
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((address, port))
        except OSError as error:
            return (error.strerror or str(error)).lower()
        except (OverflowError, UnicodeError):
            return "no such address and port: a port is a number from 1 to 65535"
    return None
