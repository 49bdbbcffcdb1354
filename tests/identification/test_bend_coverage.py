"""Springs and tendons of rehearsed benches in two planes are found, and 95 % intervals hold the truth."""

from __future__ import annotations

import math
import os
from collections import Counter

import numpy as np
import pytest

from tests.identification.bend_rigs import SETTINGS, drawn_rig, identified, logs_of

THOROUGH = bool(os.environ.get("WRISTCTL_THOROUGH"))
RIGS = int(os.environ.get("WRISTCTL_BEND_RIGS", "100" if THOROUGH else "1"))
SPRINGS = ("stiffness", "stiffness_across")
# Known beforehand as well as it is: its interval always holds.
KNOWN_BEFORE = {"presliding"}


def _error(name: str, found: float, true: float) -> float:
    """Error of a stiffness over its value, of anything else in its own unit."""
    return abs(found / true - 1.0) if name in SPRINGS else abs(found - true)


@pytest.mark.slow
def test_springs_and_tendons_of_a_bench_are_found_and_intervals_hold_the_truth() -> None:
    """Stiffnesses to 1 %, their axis to 2 deg, each tendon's direction to 1 deg; of 100 intervals 90 to 99 hold."""
    holds, worst, refused = Counter[str](), dict[str, float](), 0
    for seed in range(RIGS):
        rng = np.random.default_rng([seed, 21])
        rig = drawn_rig(rng)
        found = identified(logs_of(rig, rng))
        refused += found.misfit > SETTINGS.lack_of_fit
        for name, true in rig.truth(found.told["stiffness_axis_deg"].value).items():
            told = found.told[name]
            holds[name] += not told.known or told.low <= true <= told.high
            holds[f"{name} told"] += told.known
            worst[name] = max(worst.get(name, 0.0), _error(name, told.value, true))
    print(f"\nof {RIGS} rigs, {refused} refused")
    for name, error in worst.items():
        print(f"{name}: told {holds[f'{name} told']}, holds {holds[name]}, worst error {error:.3g}")
    assert refused <= 0.05 * RIGS
    directions = [name for name in worst if name.startswith("direction")]
    assert all(holds[f"{name} told"] == RIGS for name in (*SPRINGS, *directions, "stiffness_axis_deg", "damping"))
    # Half intervals are some 0.5 % and 0.3 deg: of 100 rigs the worst is three times as far off.
    assert max(worst[name] for name in SPRINGS) < (0.015 if RIGS > 20 else 0.01)
    assert worst["stiffness_axis_deg"] < 2.0 and max(worst[name] for name in directions) < 1.0
    if THOROUGH and RIGS >= 100:
        share = {name: holds[name] / RIGS for name in worst if name not in KNOWN_BEFORE}
        assert all(0.9 <= each <= 0.995 for each in share.values()), share
    else:
        assert sum(holds[name] for name in worst) >= 0.85 * RIGS * len(worst)
    assert math.isfinite(max(worst.values()))
