"""Certificates for a lab: an authority of its own, and one certificate for each host, made by ``openssl``.

The folder also has the secret that all hosts of its systems share.

Elliptic-curve keys (P-256). The authority's key stays in the folder; a person who has it can admit hosts.
"""

from __future__ import annotations

import ipaddress
import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

from regraft.bus_schema.keys import host_name
from regraft.security import system_secret
from regraft.security.system_secret import BadSecret

DAYS = 825
"""Days that a certificate is valid: the longest that today's TLS libraries all accept."""
ALWAYS = ("localhost", "127.0.0.1", "::1")
HOST_NAME = re.compile(r"[A-Za-z0-9_*]([A-Za-z0-9_.*-]{0,252})")
"""Names that a certificate may have for a host, wildcards included (RFC 1123; underscores are common in labs)."""


class CannotMake(Exception):
    """A certificate cannot be made; the text states why."""


def make(folder: Path, names: Sequence[str], addresses: Sequence[str] = ()) -> list[Path]:
    """Make a certificate for each host, and what is missing of authority and secret; returns the files written.

    ``addresses`` are the names and IP addresses under which hosts reach each other, next to each host's name. A host
    that has a certificate gets a new one, or keeps it and its key if that fails.

    Raises:
        CannotMake: there is no ``openssl``, or it fails, or the folder cannot be written.
        BadKey: a name cannot name a host.
    """
    for name in names:
        host_name(name)
    for address in addresses:
        _alternative(address)
    if "ca" in names:
        raise CannotMake("'ca' is the authority itself: choose another name for the host")
    if shutil.which("openssl") is None:
        raise CannotMake("there is no 'openssl' program: install it, or make the files with tools of your own")
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        written = [] if _has_authority(folder) else _make_authority(folder)
        secret = folder / system_secret.FILE
        written += [secret] if system_secret.make(secret) else []
        for name in names:
            written += _make_host(folder, name, addresses)
    except OSError as error:
        raise CannotMake(f"cannot write to {folder}: {error.strerror}") from None
    except BadSecret as error:
        raise CannotMake(str(error)) from None
    return written


def _has_authority(folder: Path) -> bool:
    files = [folder / file for file in ("ca.pem", "ca.key")]
    for file in files:
        if file.exists() and not file.is_file():
            raise CannotMake(f"{file} is not an ordinary file: remove it")
    there = [file.exists() for file in files]
    if any(there) and not all(there):
        raise CannotMake(f"{folder} has one of ca.pem and ca.key, but not both: remove it, or bring the other")
    return all(there)


def _make_authority(folder: Path) -> list[Path]:
    with tempfile.TemporaryDirectory(dir=folder) as scratch:
        key, certificate = Path(scratch) / "ca.key", Path(scratch) / "ca.pem"
        _make_key(key)
        _openssl(
            *("req", "-x509", "-new", "-key", str(key), "-days", str(DAYS), "-subj", "/CN=regraft lab"),
            *("-addext", "basicConstraints=critical,CA:TRUE", "-addext", "keyUsage=critical,keyCertSign,cRLSign"),
            *("-out", str(certificate)),
        )
        return _put(folder, certificate, key)


def _make_host(folder: Path, name: str, addresses: Sequence[str]) -> list[Path]:
    with tempfile.TemporaryDirectory(dir=folder) as scratch:
        key, certificate = Path(scratch) / f"{name}.key", Path(scratch) / f"{name}.pem"
        request, extensions = Path(scratch) / "request", Path(scratch) / "extensions"
        _make_key(key)
        alternatives = ",".join(_alternative(address) for address in dict.fromkeys((name, *ALWAYS, *addresses)))
        extensions.write_text(
            f"subjectAltName={alternatives}\nbasicConstraints=CA:FALSE\nextendedKeyUsage=serverAuth,clientAuth\n"
        )
        _openssl("req", "-new", "-key", str(key), "-subj", f"/CN={name}", "-out", str(request))
        _openssl(
            *("x509", "-req", "-in", str(request), "-CA", str(folder / "ca.pem"), "-CAkey", str(folder / "ca.key")),
            *("-CAcreateserial", "-CAserial", str(Path(scratch) / "serial"), "-days", str(DAYS)),
            *("-extfile", str(extensions), "-out", str(certificate)),
        )
        return _put(folder, certificate, key)


def _put(folder: Path, certificate: Path, key: Path) -> list[Path]:
    """Put a pair that is complete into its place."""
    return [made.replace(folder / made.name) for made in (certificate, key)]


def _alternative(address: str) -> str:
    try:
        return f"IP:{ipaddress.ip_address(address)}"
    except ValueError:
        if not HOST_NAME.fullmatch(address):
            raise CannotMake(f"the address {address!r} is neither an IP address nor the name of a host") from None
        return f"DNS:{address}"


def _make_key(path: Path) -> None:
    made = _openssl("genpkey", "-algorithm", "EC", "-pkeyopt", "ec_paramgen_curve:P-256")
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with os.fdopen(descriptor, "w") as out:
        out.write(made)


def _openssl(*arguments: str) -> str:
    done = subprocess.run(["openssl", *arguments], capture_output=True, text=True, check=False)
    if done.returncode:
        lines = done.stderr.strip().splitlines() or ["no reason given"]
        raise CannotMake(f"openssl {arguments[0]}: {lines[-1]}")
    return done.stdout
