"""How often the comparison leaves out a row that is as good as the best, and how often it finds one that is worse.

Through `standing`, which compare and study use. The old way to do it is beside: Holm's step down of Student's paired t
against the row that is best in the sample, which is chosen after it was seen. `make test-statistics` draws 2,000
comparisons of each kind and prints the rates; the suite draws few.
"""

from __future__ import annotations

import os
from collections.abc import Callable

import numpy as np
import pytest
from scipy.stats import binom, t

from wristctl.arrays import Array
from wristctl.comparison.tie_groups import standing

THOROUGH = bool(os.environ.get("WRISTCTL_THOROUGH"))
ROWS, WORLDS = (5, 10, 17), (8, 16, 250)
SPREAD = 0.1
"""Of a row's logarithms about what all share: differences of pairs spread by 14 %."""
MOST = 0.06

Draw = Callable[[np.random.Generator, int, int], Array]


def normal(rng: np.random.Generator, rows: int, worlds: int) -> Array:
    """Each row's own deviation."""
    return rng.standard_normal((rows, worlds))


def skewed(rng: np.random.Generator, rows: int, worlds: int) -> Array:
    """All rows now and then much worse (exponential)."""
    return rng.exponential(1.0, (rows, worlds)) - 1.0


def skewed_differences(rng: np.random.Generator, rows: int, worlds: int) -> Array:
    """The same beside one row that is steady: differences from that are skewed by 2."""
    found = skewed(rng, rows, worlds)
    found[0] = 0.0
    return found


def correlated(rng: np.random.Generator, rows: int, worlds: int) -> Array:
    """Three families of laws that share nine tenths of their variance, and spread from a third to thrice."""
    shared = rng.standard_normal((3, worlds))[np.arange(rows) % 3]
    found = np.sqrt(0.9) * shared + np.sqrt(0.1) * rng.standard_normal((rows, worlds))
    return np.geomspace(1.0 / 3.0, 3.0, rows)[:, None] * found


def scores(rng: np.random.Generator, draw: Draw, rows: int, worlds: int, worse: float = 1.0) -> Array:
    """Rows over worlds whose hardness differs tenfold more than rows do; the last is so many times worse."""
    own = SPREAD * draw(rng, rows, worlds)
    own[-1] += np.log(worse)
    return np.exp(rng.normal(-5.0, 1.0, worlds) + own)


def first_group(of: Array) -> list[int]:
    return standing(of, np.zeros(of.shape, bool), 7, floor=1e-12).groups[0]


def first_group_by_holm(of: Array) -> list[int]:
    logs, n = np.log(of), of.shape[1]
    best, *others = np.argsort(logs.mean(axis=1)).tolist()
    apart = logs[others] - logs[best]
    chances = 2.0 * t.sf(apart.mean(axis=1) / (apart.std(axis=1, ddof=1) / np.sqrt(n)), n - 1)
    kept = {best, *others}
    for done, at in enumerate(np.argsort(chances).tolist()):
        if chances[at] > 0.05 / (len(others) - done):
            break
        kept.remove(others[at])
    return sorted(kept)


def test_holms_step_down_against_the_samples_best_keeps_no_rate() -> None:
    """The judge of the rates finds what it is there for."""
    rng = np.random.default_rng(2)
    out = sum(len(first_group_by_holm(scores(rng, normal, 17, 40))) < 17 for _ in range(400))
    assert out > 0.14 * 400


@pytest.mark.parametrize("draw", [normal, skewed, skewed_differences, correlated])
@pytest.mark.slow
def test_an_equal_law_is_left_out_in_at_most_6_percent_of_comparisons(draw: Draw) -> None:
    for rows in ROWS:
        for worlds in WORLDS:
            if not THOROUGH and (rows > 5 or worlds > 8):
                continue
            times = 2000 if THOROUGH else 500
            rng = np.random.default_rng([rows, worlds])
            drawn = [scores(rng, draw, rows, worlds) for _ in range(times)]
            out, before = (
                sum(len(group(each)) < rows for each in drawn) for group in (first_group, first_group_by_holm)
            )
            if THOROUGH:
                rates = f"{100.0 * out / times:4.1f} % (Holm {100.0 * before / times:4.1f} %)"
                print(f"{draw.__name__:18} {rows:2} rows {worlds:3} worlds: left out {rates}", flush=True)
            assert out <= binom.ppf(0.999, times, MOST), (draw.__name__, rows, worlds)


@pytest.mark.slow
def test_a_law_that_is_10_percent_worse_is_found() -> None:
    """By the side of equal ones; more of them cost power, more worlds buy it."""
    found = {}
    for rows in ROWS:
        for worlds in (8, 16, 40, 250):
            if not THOROUGH and (rows > 5 or worlds not in (16, 40)):
                continue
            times = 1000 if THOROUGH else 60
            rng = np.random.default_rng([rows, worlds, 1])
            drawn = [scores(rng, normal, rows, worlds, 1.1) for _ in range(times)]
            told, before = (
                sum(rows - 1 not in group(each) for each in drawn) for group in (first_group, first_group_by_holm)
            )
            found[rows, worlds] = told / times
            if THOROUGH:
                rates = f"{100.0 * told / times:5.1f} % (Holm {100.0 * before / times:5.1f} %)"
                print(f"10 % worse of {rows:2} rows, {worlds:3} worlds: found {rates}", flush=True)
    assert 0.45 < found[5, 16] < 0.85 and found[5, 40] > 0.9
