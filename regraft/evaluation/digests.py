"""Digests of runs: equal for equal runs, at any speed on the wall clock."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.model.adaptation import AdaptationReport

START = bytes(32)


def extended(digest: bytes, payload: bytes) -> bytes:
    """Return the digest (32 bytes) of a chain with one more payload; it can be stored, a hash object not."""
    return hashlib.sha256(digest + payload).digest()


def combined(chains: Mapping[str, bytes]) -> str:
    """Return one digest, as hexadecimal text, of several chains by name."""
    return hashlib.sha256(b"".join(name.encode() + chains[name] for name in sorted(chains))).hexdigest()


def adaptation_bytes(report: AdaptationReport) -> bytes:
    """Return what counts of an adaptation: what was changed, when in simulated time, and how it went.

    Identifiers, texts and durations differ between equal runs. The resulting architecture follows from the changes, and
    names files of this machine.
    """
    plain = codec.to_plain(report)
    changes = plain["request"]["changes"]
    steps = [[step["number"], step["component"], step["action"], step["state"]] for step in plain["steps"]]
    counted = [
        plain["outcome"],
        plain["tick"],
        plain["revision_before"],
        plain["revision_after"],
        changes,
        steps,
    ]
    return codec.pack_plain(counted)
