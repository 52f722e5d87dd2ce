"""Joins tables of results: a campaign may be made in parts, also on several machines."""

from __future__ import annotations

from collections.abc import Sequence

from regraft.evaluation.results.table import BadTable, ResultTable

OF_ALL = ("study", "definitions", "seconds", "code")
"""The columns in which all runs of a campaign are equal; so is the renderer of those that have one."""


def joined(tables: Sequence[ResultTable]) -> ResultTable:
    """Return the runs of several tables as one: scenarios and arms in the order in which each comes first.

    Raises BadTable where runs differ in what a campaign has one of, or one is in two tables.
    """
    first = tables[0]
    origin: dict[tuple[str, int], str] = {}
    known: dict[str, tuple[object, str]] = {}
    for table in tables:
        if table.measures != first.measures:
            raise BadTable(f"{table.file}: its measures are not those of {first.file}")
        for row in table.rows:
            for column in (*OF_ALL, *(["renderer"] if row.renderer else [])):
                is_now = getattr(row, column)
                was, file = known.setdefault(column, (is_now, table.file))
                if was != is_now:
                    raise BadTable(f"{table.file}: {column}: is {is_now!r}, in {file} {was!r}: a campaign has one")
            place = (row.configuration, row.seed)
            if place in origin:
                raise BadTable(f"{table.file}: {row.configuration} with seed {row.seed} is in {origin[place]}, too")
        origin |= {(row.configuration, row.seed): table.file for row in table.rows}
    rows = [row for table in tables for row in table.rows]
    keys = list(dict.fromkeys((row.scenario, row.arm) for row in rows))
    scenarios = list(dict.fromkeys(row.scenario for row in rows))
    rows.sort(key=lambda row: (scenarios.index(row.scenario), keys.index((row.scenario, row.arm))))
    return ResultTable(first.measures, tuple(rows), first.file)
