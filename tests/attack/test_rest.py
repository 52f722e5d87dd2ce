"""Every route of the gateway, with requests generated from its document."""

from __future__ import annotations

from functools import partial

import pytest

from tests.attack.tally import Tally
from tests.gateway.http.generated import attacked
from tests.hostile.conftest import HEAD, SINK, SOURCE, Start
from tests.hostile.rest import Rest

pytestmark = [pytest.mark.attack, pytest.mark.timeout(900)]

EXAMPLES = 200
WITH_MISSION = HEAD.replace("components:\n", "  mission: {type: regraft/MissionStatus}\ncomponents:\n")
EXECUTOR = "  bt_executor: {class: 'regraft.services.bt_executor.executor:Executor'}\n"


def test_no_request_that_the_document_allows_is_called_malformed_or_fails(
    start: Start, seed: int, tally: Tally
) -> None:
    with Rest(partial(start, head=WITH_MISSION), SOURCE + SINK + EXECUTOR) as rest:
        for seen in attacked(f"http://127.0.0.1:{rest.port}", ["source", "sink"], EXAMPLES, seed):
            right = seen.statuses.total() - len(seen.wrong)
            tally.many("generated REST request", right)
            for wrong in seen.wrong:
                with tally.one("generated REST request", seen.operation):
                    raise AssertionError(wrong)
