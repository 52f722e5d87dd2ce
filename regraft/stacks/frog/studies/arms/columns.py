"""The figures of one run of FROG's rounds, by name: each is a column of the results."""

from __future__ import annotations

from functools import partial
from typing import Final

from regraft.evaluation.rows import Rows
from regraft.evaluation.study import Measure
from regraft.stacks.frog.studies import rounds_measures as measures

AS_PUBLISHED: Final[dict[str, Measure]] = {
    "hits per call": measures.hits_per_look,
    "hits per picture": measures.hits_per_picture,
    "v/v_max": measures.published_velocity_ratio,
    "1/W": measures.published_inverse_power,
    "U_vis": measures.published_visiting_utility,
    "U_det": measures.published_detecting_utility,
    "U_vis, text": partial(measures.published_visiting_utility, satisfied=measures.text_satisfied),
}
"""``U_vis, text`` is U_vis with MoveSafely as the paper's text defines it."""
CORRECTED: Final[dict[str, Measure]] = {
    "U_vis": measures.visiting_utility,
    "U_det": measures.detecting_utility,
    "hits per picture": measures.hits_per_picture,
    "within the budget": measures.within_budget_share,
    "v/v_max": measures.velocity_ratio,
    "1/W": measures.inverse_power,
    "MoveSafely": measures.safe_share,
    "near": measures.near_share,
    "legs": measures.legs_driven,
}
OTHER_READINGS: Final[dict[str, Measure]] = {
    "U_vis, commanded maximum": partial(measures.other_visiting_utility, satisfied=measures.is_commanded_safely),
    "U_vis, ≤ 0.18 is slow": partial(measures.other_visiting_utility, satisfied=measures.at_most_slowly),
    "U_vis, mean speed": partial(
        measures.other_visiting_utility, satisfied=measures.moves_safely_on_average, speed=measures.mean_speed
    ),
    "U_vis, W of the leg": partial(measures.other_visiting_utility, cost=measures.mean_power),
    "U_vis, W in J": partial(measures.other_visiting_utility, cost=measures.energy),
    "U_det, per call": measures.published_detecting_utility,
}
"""The utilities by other readings of MoveSafely, v and W than those of `regraft.stacks.frog.utility`."""
SENSITIVITY: Final[dict[str, Measure]] = {
    "U_vis": measures.visiting_utility,
    **{name: measure for name, measure in OTHER_READINGS.items() if name.startswith("U_vis")},
    "U_det": measures.detecting_utility,
    "U_det, per call": measures.published_detecting_utility,
}


def _last(name: str) -> Measure:
    def last(rows: Rows) -> float:
        return measures.final(rows, name)

    return last


TRADE_OFFS: Final[dict[str, Measure]] = {
    "drive energy (J)": measures.energy_driven,
    "picture energy (J)": _last("picture_energy"),
    "pictures": measures.pictures,
    "hits": measures.hits,
    "own pictures": _last("own_pictures"),
    "own hits": _last("own_hits"),
    "corner pictures": _last("corner_pictures"),
    "corner hits": _last("corner_hits"),
    "looks": _last("looks"),
    "contacts": _last("contacts"),
    "adaptations applied": _last("changes"),
}
"""The price of the utilities: what the robot took, touched and changed for them."""
COLUMNS: Final[dict[str, dict[str, Measure]]] = {
    "published": {
        **AS_PUBLISHED,
        **{f"{name}, corrected": measure for name, measure in CORRECTED.items() if name != "hits per picture"},
        **TRADE_OFFS,
    },
    "corrected": {**CORRECTED, **OTHER_READINGS, **TRADE_OFFS},
}
