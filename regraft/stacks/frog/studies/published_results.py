"""The published results of ReBeT's evaluation B, recomputed from its published rows.

Each is the mean and the standard deviation of 25 runs.
The columns are labelled by what they are: in the paper's Table I those of v/v_max and 1/W are exchanged.
"""

from __future__ import annotations

from typing import Final

PUBLISHED: Final[dict[str, dict[str, tuple[float, float]]]] = {
    "baseline": {
        "hits per call": (0.0941, 0.0289),
        "hits per picture": (0.0941, 0.0289),
        "v/v_max": (0.7823, 0.0599),
        "1/W": (0.03017, 0.00391),
        "U_vis": (0.001328, 0.000388),
        "U_det": (0.0941, 0.0289),
        "U_vis, text": (0.01488, 0.00344),
    },
    "internal": {
        "hits per call": (1.2740, 0.1010),
        "hits per picture": (0.5952, 0.0363),
        "v/v_max": (0.4902, 0.0282),
        "1/W": (0.02396, 0.00266),
        "U_vis": (0.003787, 0.000562),
        "U_det": (1.1960, 0.1140),
        "U_vis, text": (0.01107, 0.00167),
    },
    "external": {
        "hits per call": (1.3307, 0.1346),
        "hits per picture": (0.6253, 0.0423),
        "v/v_max": (0.5571, 0.0685),
        "1/W": (0.02971, 0.00310),
        "U_vis": (0.004575, 0.001338),
        "U_det": (1.2722, 0.1247),
        "U_vis, text": (0.01223, 0.00274),
    },
}
PUBLISHED_P: Final = {
    ("internal", "U_vis"): 7.08e-10,
    ("external", "U_vis"): 6.54e-9,
    ("internal", "U_det"): 7.07e-10,
    ("external", "U_det"): 7.07e-10,
}
"""One-sided p of being greater than the baseline, uncorrected."""
