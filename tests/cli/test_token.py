"""Tokens are made, listed and revoked, whether the system runs or not; only hashes are kept."""

from __future__ import annotations

import hashlib
import json
import os
import re
import stat
import threading
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import pytest

from regraft import run_directory
from regraft.cli.outcomes import BAD_INPUT, NOT_REACHABLE
from regraft.run_directory import NoRoom, RunInfo
from regraft.security.tokens import BadToken, BadTokens, Role, Tokens
from tests.cli.conftest import Regraft
from tests.support.waiting import PATIENCE

MAKE = ("token", "create", "--role", "operate", "--for", "8h", "--system", "frog")


def kept(home: Path) -> list[dict[str, Any]]:
    tokens: list[dict[str, Any]] = json.loads((home / "frog" / "tokens.json").read_text())["tokens"]
    return tokens


def test_a_token_is_printed_once_and_only_its_hash_is_kept(regraft: Regraft, home: Path) -> None:
    made = regraft(*MAKE, "--name", "page")
    assert made.exit_code == 0
    token = made.stdout.strip()
    assert len(token) > 40
    assert "page" in made.stderr
    assert token not in made.stderr
    (entry,) = kept(home)
    assert entry["digest"] == hashlib.sha256(token.encode()).hexdigest()
    for path in home.rglob("*"):
        assert path.is_dir() or token not in path.read_text()
    assert token not in regraft("token", "list", "--system", "frog").output
    found = Tokens(run_directory.folder("frog")).find(token)
    assert found
    assert (found.name, found.role) == ("page", Role.OPERATE)


def test_the_file_is_readable_by_its_user_alone(regraft: Regraft, home: Path) -> None:
    mask = os.umask(0)
    try:
        regraft(*MAKE)
    finally:
        os.umask(mask)
    assert stat.S_IMODE((home / "frog" / "tokens.json").stat().st_mode) == 0o600
    assert [path.name for path in (home / "frog").iterdir()] == ["tokens.json"]


def test_tokens_are_shown_with_role_and_end(regraft: Regraft, home: Path) -> None:
    made = json.loads(regraft(*MAKE, "--json").stdout)
    assert made["system"] == "frog"
    assert made["role"] == "operate"
    length = datetime.fromisoformat(made["expires"]) - datetime.fromisoformat(made["created"])
    assert length == timedelta(hours=8)
    (listed,) = json.loads(regraft("token", "list", "--system", "frog", "--json").stdout)["tokens"]
    assert listed == {name: made[name] for name in ("name", "role", "created", "expires", "expired")}
    assert made["name"] in regraft("token", "list", "--system", "frog").stdout
    assert "no tokens" in regraft("token", "list", "--system", "other").stdout
    assert not (home / "other").exists()


def test_a_revoked_token_is_forgotten(regraft: Regraft, home: Path) -> None:
    token = regraft(*MAKE, "--name", "page").stdout.strip()
    desk = regraft(*MAKE, "--name", "desk").stdout.strip()
    assert json.loads(regraft("token", "revoke", "page", "--system", "frog", "--json").stdout)["revoked"] == "page"
    tokens = Tokens(run_directory.folder("frog"))
    assert tokens.find(token) is None
    assert tokens.find(desk)
    again = regraft("token", "revoke", "page", "--system", "frog")
    assert again.exit_code == BAD_INPUT
    assert "desk" in again.stderr


def test_the_running_system_is_meant_unless_another_is_named(regraft: Regraft, home: Path) -> None:
    without = regraft("token", "create", "--role", "operate", "--for", "8h")
    assert without.exit_code == NOT_REACHABLE
    held = run_directory.lock("robot")
    run_directory.write_info(RunInfo("robot", "1", 1, "tcp/127.0.0.1:1", "stack.yaml", False))
    with held:
        assert regraft("token", "create", "--role", "administer", "--for", "30m").exit_code == 0
        assert json.loads(regraft("token", "list", "--json").stdout)["system"] == "robot"
        assert json.loads(regraft("--system", "frog", "token", "list", "--json").stdout)["system"] == "frog"


@pytest.mark.parametrize("duration", ["8", "h", "8 hours", "-8h", "1.5h", "8H", "", "٨h"])
def test_a_duration_that_is_none_is_bad_input(regraft: Regraft, home: Path, duration: str) -> None:
    found = regraft("token", "create", "--role", "operate", f"--for={duration}", "--system", "frog")
    assert found.exit_code == BAD_INPUT
    assert "30m, 8h or 7d" in found.stderr
    assert list(home.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("--for", "0s"), "must be 1 s to 366 d"),
        (("--for", "400d"), "must be 1 s to 366 d"),
        (("--role", "own"), "'operate', 'administer'"),
        (("--name", "a b"), "cannot name a token"),
        (("--name", "a:b"), "cannot name a token"),
        (("--name", "x" * 65), "cannot name a token"),
        (("--system", "../frog"), "cannot name a system"),
    ],
)
def test_what_cannot_be_a_token_is_bad_input(
    regraft: Regraft, home: Path, arguments: tuple[str, ...], told: str
) -> None:
    found = regraft(*MAKE, *arguments)
    assert found.exit_code == BAD_INPUT
    assert told in found.stderr
    assert list(home.iterdir()) == []


def test_a_name_is_given_once_and_again_when_it_has_expired(home: Path) -> None:
    tokens = Tokens(home / "frog")
    tokens.create(Role.OPERATE, 60.0, "page")
    with pytest.raises(BadToken, match="revoke it first"):
        tokens.create(Role.OPERATE, 60.0, "page")
    expire(home)
    assert [token.expired for token in tokens.all()] == [True]
    token, made = tokens.create(Role.ADMINISTER, 60.0, "page")
    assert tokens.find(token) == made
    assert len(tokens.all()) == 1


def expire(home: Path) -> None:
    path = home / "frog" / "tokens.json"
    path.write_text(json.dumps({"tokens": [{**entry, "expires": 1.0} for entry in kept(home)]}))


def test_an_expired_token_is_shown_and_not_honoured(regraft: Regraft, home: Path) -> None:
    token = regraft(*MAKE).stdout.strip()
    expire(home)
    assert Tokens(run_directory.folder("frog")).find(token) is None
    assert "expired" in regraft("token", "list", "--system", "frog").stdout


@pytest.mark.parametrize(
    ("damage", "told"),
    [
        (lambda text: text[:-9], "is not JSON"),
        (lambda text: "", "is not JSON"),
        (lambda text: "[" * 100_000, "is not JSON"),
        (lambda text: "\ud800".encode("utf-8", "surrogatepass"), "is not JSON"),
        (lambda text: "[]", "tokens"),
        (lambda text: '{"tokens": {}}', "tokens"),
        (lambda text: text.replace("operate", "own"), "tokens.0.role"),
        (lambda text: text.replace('"digest": "', '"digest": "x'), "tokens.0.digest"),
        (lambda text: text.replace('"expires"', '"ends"'), "tokens.0"),
        (lambda text: '{"tokens": [7]}', "tokens.0"),
        (lambda text: re.sub('"expires": [0-9.]+', '"expires": 1e300', text), "tokens.0.expires"),
        (lambda text: re.sub('"expires": [0-9.]+', '"expires": NaN', text), "tokens.0.expires"),
    ],
)
def test_a_damaged_file_is_a_clear_error_and_admits_nobody(
    regraft: Regraft, home: Path, damage: Any, told: str
) -> None:
    token = regraft(*MAKE, "--name", "page").stdout.strip()
    tokens = Tokens(run_directory.folder("frog"))
    assert tokens.find(token)
    path = home / "frog" / "tokens.json"
    damaged = damage(path.read_text())
    path.write_bytes(damaged if isinstance(damaged, bytes) else damaged.encode())
    for arguments in (("list",), ("revoke", "page"), MAKE[1:-2]):
        found = regraft("token", *arguments, "--system", "frog")
        assert found.exit_code == BAD_INPUT
        assert str(path) in found.stderr
        assert told in found.stderr
    with pytest.raises(BadTokens):
        tokens.find(token)
    assert path.read_bytes() == (damaged if isinstance(damaged, bytes) else damaged.encode())


def test_a_file_that_others_can_read_or_write_admits_nobody(regraft: Regraft, home: Path) -> None:
    token = regraft(*MAKE).stdout.strip()
    tokens = Tokens(run_directory.folder("frog"))
    tokens.path.chmod(0o644)
    with pytest.raises(BadTokens, match="chmod 600"):
        tokens.find(token)
    tokens.path.chmod(0o600)
    assert tokens.find(token)


def test_tokens_made_at_the_same_time_are_all_kept(home: Path) -> None:
    made: list[str] = []
    makers = [
        threading.Thread(target=lambda: made.append(Tokens(home / "frog").create(Role.OPERATE, 60.0)[0]))
        for _ in range(20)
    ]
    for maker in makers:
        maker.start()
    for maker in makers:
        maker.join(2 * PATIENCE)
    tokens = Tokens(home / "frog")
    assert len(made) == 20
    assert all(tokens.find(token) for token in made)


def test_a_folder_that_cannot_be_written_is_a_clear_error(home: Path) -> None:
    (home / "frog").write_text("a file")
    with pytest.raises(NoRoom, match=r"cannot write .*tokens\.json"):
        Tokens(home / "frog").create(Role.OPERATE, 60.0)
