"""A hash that shows whether two processes look at the same world."""

import hashlib

from regraft.sim_service.layout.placement import Placement
from regraft.sim_service.layout.scene import Scene


def world_hash(scene: Scene, placement: Placement) -> str:
    """Return a SHA-256 of a compiled world and of where its placed bodies stand."""
    places = sorted(placement.to_plain().items())
    return hashlib.sha256(f"{scene.fingerprint} {places!r}".encode()).hexdigest()
