"""The renderers that tests of cameras try: the one that works everywhere, and the best one of this machine."""

from __future__ import annotations

from functools import cache

from sim_service.renderers import RendererName, probe


@cache
def best() -> RendererName:
    """Return the best renderer; found out when a test needs it, so that every worker collects the same tests."""
    return probe().renderer


def renderers() -> list[RendererName]:
    """Return the renderers to try, each once."""
    return ["ray"] if best() == "ray" else ["ray", best()]
