"""The last message before a link broke arrives, although no other follows it."""

from __future__ import annotations

import pytest

from regraft import run_directory
from regraft.client import ClientError
from tests.host.several import WAIT, Site
from tests.support.links import Cable
from tests.support.waiting import wait_until

pytestmark = pytest.mark.slow

ACROSS = """\
  ending: {class: 'tests.host.parts:Ending', host: ENDING, parameters: {done: $RUN/done}}
  counting: {class: 'tests.host.parts:Counting', host: COUNTING}
"""


@pytest.mark.parametrize(("ending", "counting"), [("edge", "local"), ("local", "edge")])
def test_what_was_last_when_a_link_broke_arrives_once_it_is_back(site: Site, ending: str, counting: str) -> None:
    system = site.up(ACROSS.replace("ENDING", ending).replace("COUNTING", counting), WAIT)
    cable = Cable(int(system.info.endpoint.rpartition(":")[2]))
    try:
        site.join(endpoint=f"tcp/127.0.0.1:{cable.port}")
        wait_until(lambda: _heard(site).get("last", 0) > 10, "some ticks")
        cable.plugged = False
        cable.cut()
        done = run_directory.folder("tests@edge" if ending == "edge" else "tests") / "done"
        wait_until(done.exists, "the last tick")
        cable.plugged = True
        wait_until(lambda: _heard(site) == {"last": 100, "wrong": 0}, "the last tick to arrive")
    finally:
        cable.close()


def _heard(site: Site) -> dict[str, int]:
    """Return what has come; nothing while the link is still broken."""
    try:
        return site.snapshot("counting")
    except ClientError:
        return {}
