"""Whatever the child does and however late answers come, its result is returned once, and it is let alone then."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from regraft.bus_schema.model.adaptation import Outcome
from tests.adapting.helpers import FakeContext, bench

NODE_TYPES = (
    "AdaptOnStart",
    "AdaptOnRunning",
    "AdaptOnSuccess",
    "AdaptOnFailure",
    "AdaptOnAnyStatus",
    "AdaptPeriodically",
)
BAD = (Outcome.REJECTED, Outcome.ROLLED_BACK, Outcome.STUCK, Outcome.CANCELLED)
POLICIES = ("ignore", "retry 2", "fail", "retry 1 then fail")
PORTS = (
    'rules="!quiet : navigator.max_velocity := speed within [0.01, 0.25]" timeout="800ms" retry_after="300ms" '
    'on_rejected="{p}" on_rolled_back="{p}" on_stuck="{p}" on_no_answer="{p}"'
)
MAX_TICKS = 400


@settings(max_examples=150, deadline=None)
@given(
    node_type=st.sampled_from(NODE_TYPES),
    child=st.lists(st.just("RUNNING"), max_size=8),
    result=st.sampled_from(("SUCCESS", "FAILURE", "SKIPPED")),
    delays=st.lists(st.integers(0, 12), min_size=1, max_size=6),
    fates=st.lists(st.sampled_from((Outcome.APPLIED, *BAD)), max_size=6),
    policy=st.sampled_from(POLICIES),
    halts=st.lists(st.integers(1, 30), max_size=2),
    quiet=st.booleans(),
)
def test_a_child_is_run_to_its_end_once_and_its_result_returned_once(
    node_type: str,
    child: list[str],
    result: str,
    delays: list[int],
    fates: list[Outcome],
    policy: str,
    halts: list[int],
    quiet: bool,
) -> None:
    ports = PORTS + (' adaptation_period="250ms"' if node_type == "AdaptPeriodically" else "")
    context = FakeContext(answers=False, fates=list(fates))
    at = bench(node_type, ports, " ".join([*child, result]), context=context, quiet=quiet, speed=0.1, p=policy)
    waited, runs = 0, 0
    started, ticked = 0, 0
    for tick in range(1, MAX_TICKS):
        at.set(speed=0.1 + 0.001 * (tick % 7))
        status = at.tick(0.1)
        if status != "RUNNING":
            assert status == result or (status == "FAILURE" and "fail" in policy)
            assert at.child.starts - started <= 1
            if status == result and "fail" not in policy:
                assert at.child.starts - started == 1
                assert at.child.ticks - ticked == len(child) + 1, "the child is ticked to its end, and not once more"
            assert not at.node.under_way.busy
            assert at.tree.next_wake_up() is None
            assert at.child.status == 0
            started, ticked, runs = at.child.starts, at.child.ticks, runs + 1
            if runs == 3:
                return
        elif tick in halts:
            at.tree.halt_tree()
            assert at.idle
            assert at.child.status == 0
            started, ticked = at.child.starts, at.child.ticks
        waited += 1
        if context.pending and waited > delays[len(context.asked) % len(delays)]:
            context.answer()
            waited = 0
    raise AssertionError("the wait for an answer, or for another try, does not end")
