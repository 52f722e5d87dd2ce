"""HTTP by a process of its own, as any user of this machine."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from typing import Any
from urllib.parse import urlsplit

from tests.support.waiting import PATIENCE

NOBODY = 65534
SCRIPT = """
import encodings.idna, http.client, json, os, socket, sys
host, port, uid, requests, bound = json.load(sys.stdin)
if uid is not None:
    os.setgroups([])
    os.setgid(uid)
    os.setuid(uid)
answers = []
for method, path, headers, body in requests:
    connection = http.client.HTTPConnection(host, port, timeout=bound)
    connection.request(method, path, body, headers)
    answer = connection.getresponse()
    answers.append([answer.status, dict(answer.getheaders()), answer.read().decode()])
    connection.close()
print(json.dumps(answers))
"""


Asked = tuple[str, str, dict[str, str], str | None]
"""A request: its method, path, headers and body."""


def ask_as(uid: int | None, url: str, requests: Sequence[Asked]) -> list[Any]:
    """Send requests as a user, None for the present one; returns status, headers and body of each answer."""
    parts = urlsplit(url)
    given = json.dumps([parts.hostname, parts.port, uid, requests, PATIENCE])
    command = [sys.executable, "-I", "-c", SCRIPT]
    done = subprocess.run(command, input=given, capture_output=True, text=True, timeout=4 * PATIENCE, check=False)
    assert done.returncode == 0, done.stderr
    answers: list[Any] = json.loads(done.stdout)
    return answers


ORPHAN = """
import os, socket, sys
host, port, request = sys.argv[1], int(sys.argv[2]), sys.stdin.buffer.read()
os.setgroups([])
os.setgid(65534)
os.setuid(65534)
connection = socket.socket()
connection.connect((host, port))
connection.sendall(request)
connection.close()
"""


def send_and_leave(url: str, request: bytes) -> None:
    """Send a request as another user who closes the connection at once, without waiting for an answer."""
    parts = urlsplit(url)
    command = [sys.executable, "-I", "-c", ORPHAN, str(parts.hostname), str(parts.port)]
    subprocess.run(command, input=request, timeout=2 * PATIENCE, check=True)
