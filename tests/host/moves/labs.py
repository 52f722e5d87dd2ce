"""Certificates that ``regraft certificates`` would not make, and hosts that do not look at their own."""

from __future__ import annotations

import subprocess
import sys
from datetime import UTC, datetime, timedelta
from pathlib import Path

from tests.support.paths import ROOT
from tests.support.waiting import PATIENCE

CONFIGURATION = """\
[ca]
default_ca = lab
[lab]
database = {scratch}/index
rand_serial = yes
new_certs_dir = {scratch}
default_md = sha256
policy = any
copy_extensions = none
x509_extensions = host
[any]
commonName = supplied
[host]
subjectAltName = DNS:localhost,IP:127.0.0.1
extendedKeyUsage = serverAuth,clientAuth
"""
TRUSTING = """
import sys
from regraft.system.first_host import CannotJoin
from regraft.system.join import Wanted, run_guest
from regraft.bus.interface import BusError
from regraft.bus.zenoh_config import Endpoints, Tls
endpoint, name, secret, *files = sys.argv[1:]
try:
    run_guest(Wanted(Endpoints(connect=(endpoint,), tls=Tls(*files), secret=secret), name))
except (CannotJoin, BusError) as error:
    print(type(error).__name__, error)
"""


def certify(folder: Path, name: str, begins: timedelta, ends: timedelta) -> None:
    """Have a lab's authority sign a host's key anew, valid between two moments as seen from now."""
    scratch = folder / "scratch"
    scratch.mkdir(exist_ok=True)
    (scratch / "index").write_text("")
    (scratch / "configuration").write_text(CONFIGURATION.format(scratch=scratch))
    openssl("req", "-new", "-key", f"{folder}/{name}.key", "-subj", f"/CN={name}", "-out", f"{scratch}/request")
    openssl(
        *("ca", "-batch", "-notext", "-config", f"{scratch}/configuration", "-in", f"{scratch}/request"),
        *("-cert", f"{folder}/ca.pem", "-keyfile", f"{folder}/ca.key", "-out", f"{folder}/{name}.pem"),
        *("-startdate", _moment(begins), "-enddate", _moment(ends)),
    )


def openssl(*arguments: str) -> None:
    """Run ``openssl``."""
    subprocess.run(["openssl", *arguments], check=True, capture_output=True)


def _moment(since: timedelta) -> str:
    return (datetime.now(UTC) + since).strftime("%Y%m%d%H%M%SZ")


def join_unchecked(endpoint: str, name: str, secret: str, lab: Path, whose: str) -> str:
    """Join under a name with somebody's certificate, without a look at it before; returns why that failed."""
    files = [str(lab / file) for file in ("ca.pem", f"{whose}.pem", f"{whose}.key")]
    done = subprocess.run(
        [sys.executable, "-c", TRUSTING, endpoint, name, secret, *files],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    return done.stdout or done.stderr
