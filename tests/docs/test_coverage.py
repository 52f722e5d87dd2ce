"""The table of `make coverage` counts statements and branches by room."""

from __future__ import annotations

from tests.coverage_by_room import by_room


def test_a_room_is_a_folder_of_regraft_or_a_package_beside_it() -> None:
    def file(lines: int, branches: int) -> dict[str, dict[str, int]]:
        counts = {"covered_lines": lines, "covered_branches": branches, "num_statements": 10, "num_branches": 2}
        return {"summary": counts}

    files = {
        "behavior_tree/nodes/node.py": file(9, 1),
        "regraft/bus/inbox.py": file(10, 2),
        "regraft/bus/interface.py": file(4, 0),
        "regraft/planar.py": file(5, 1),
    }
    assert by_room(files) == {
        "behavior_tree": (10, 12),
        "regraft": (6, 12),
        "regraft/bus": (16, 24),
        "all": (32, 48),
    }
