"""The renderers that tests of cameras try: the one that works everywhere, and the best one of this machine."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path

from regraft.sim_service.cameras.renderers import RendererName, probe


@cache
def best() -> RendererName:
    """Return the best renderer; found out when a test needs it, so that every worker collects the same tests."""
    return probe().renderer


def renderers() -> list[RendererName]:
    """Return the renderers to try, each once."""
    return ["ray"] if best() == "ray" else ["ray", best()]


def without_opengl(folder: Path) -> dict[str, str]:
    """Return an environment whose processes cannot load OpenGL: the first files of these names are no libraries."""
    folder.mkdir()
    for name in ("libEGL.so", "libEGL.so.1", "libOSMesa.so", "libOSMesa.so.8", "libOSMesa.so.6"):
        (folder / name).touch()
    kept = {name: value for name, value in os.environ.items() if name != "REGRAFT_RENDERER"}
    return {**kept, "LD_LIBRARY_PATH": str(folder)}
