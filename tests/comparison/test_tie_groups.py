"""Groups of ties: which rows may be best, who stands in none and why, and how little a family of worlds can tell."""

from __future__ import annotations

from itertools import chain
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.stats import skew, studentized_range, t, ttest_rel

from wristctl.arrays import Array
from wristctl.comparison.bootstrap import FAILURE, MEASURABLE
from wristctl.comparison.model_confidence_set import LEAST_PAIRS, PairedComparisons
from wristctl.comparison.tie_groups import Standing, share, standing

RANGE = 50.0


def drawn(seed: int, factors: list[float], worlds: int = 40, own: float = 0.1) -> Array:
    """Scores (R, W): worlds of different hardness, in which each row is its factor worse, and what is its own."""
    rng = np.random.default_rng(seed)
    hardness = rng.normal(0.0, 1.0, worlds)
    return np.exp(hardness + np.log(factors)[:, None] + own * rng.standard_normal((len(factors), worlds)))


def stand(scores: Array, swings: NDArray[Any] | None = None, **more: Any) -> Standing:
    swinging = np.zeros(scores.shape, bool) if swings is None else swings.astype(bool)
    return standing(scores, swinging, 3, **({"failure": RANGE, "floor": 1e-9} | more))


def test_rows_that_differ_stand_in_groups_from_best_to_worst() -> None:
    """Over worlds whose hardness differs tenfold more than the rows do: only pairs can tell."""
    scores = drawn(1, [2.0, 1.0, 1.5, 1.0, 2.0])
    found = stand(scores)
    assert [sorted(group) for group in found.groups] == [[1, 3], [2], [0, 4]]
    assert [found.group(row) for row in range(5)] == [3, 1, 2, 1, 3] and found.order == [*chain(*found.groups)]
    means = np.log(scores).mean(axis=1)
    assert all(np.diff(means[group]).min(initial=0.0) >= 0.0 for group in found.groups)


def test_two_rows_are_told_apart_where_students_paired_test_does() -> None:
    """Wherever its probability is not near 5 %."""
    told = [0, 0]
    for seed in range(60):
        scores = drawn(seed, [1.0, 1.04], worlds=30)
        p = float(ttest_rel(*np.log(scores)).pvalue)
        if not 0.5 < p / 0.05 < 1.5:
            told[p < 0.05] += 1
            assert len(stand(scores).groups) == 1 + (p < 0.05), (seed, p)
    assert min(told) >= 10


@pytest.mark.slow
def test_what_a_pair_must_differ_by_grows_with_the_rows_as_tukeys_range_does() -> None:
    """The smallest difference that is told as a rule, against the quantile of the studentised range."""
    for rows in (2, 5, 12):
        scores = drawn(9, [1.0] * rows, worlds=400)
        expected = studentized_range.ppf(0.95, rows, 399 * (rows - 1)) * 0.1 / np.sqrt(400)
        assert np.log(stand(scores).floor) == pytest.approx(expected, rel=0.06), rows
    pair = np.log(drawn(10, [1.0, 1.0], worlds=25))
    half = t.ppf(0.975, 24) * (pair[1] - pair[0]).std(ddof=1) / 5.0
    assert np.log(stand(np.exp(pair)).floor) == pytest.approx(half, rel=0.15)


def test_a_law_that_is_as_good_as_the_best_stays_though_a_noisier_one_is_better_on_average() -> None:
    """Steady 1 and 1.02 are told apart; a third row that jumps by a factor is told from neither."""
    rng = np.random.default_rng(0)
    steady = np.exp(rng.normal(0.0, 1.0, 40))
    scores = np.array(
        [steady, 1.02 * steady * np.exp(0.01 * rng.standard_normal(40)), 1.1 * steady * np.exp(rng.standard_normal(40))]
    )
    assert stand(scores).groups[0] == [0, 2] and stand(scores).groups[1] == [1]


@pytest.mark.parametrize("rows", [2, 5])
def test_fewer_pairs_than_could_ever_tell_are_neither_ranked_nor_a_tie(rows: int) -> None:
    """Whatever the difference: each row a hundred times worse than the one before, in every world."""
    for worlds in range(1, LEAST_PAIRS):
        found = stand(drawn(8, [100.0**k for k in range(rows)], worlds=worlds), failure=1e15)
        assert found.groups == [] and found.untold == list(range(rows)) and found.floor == np.inf
        assert all(found.group(row) is None and found.fate(row) == "too few to tell" for row in range(rows))
    found = stand(drawn(8, [100.0**k for k in range(rows)], worlds=LEAST_PAIRS), failure=1e15)
    assert found.groups == [[row] for row in range(rows)] and found.untold == []


def test_a_row_that_is_alone_needs_no_worlds_to_be_first() -> None:
    scores = drawn(8, [1.0, 1.0, 1.0], worlds=2)
    found = stand(scores, np.array([[0, 0], [1, 0], [0, 1]]))
    assert found.groups == [[0]] and sorted(found.unreliable) == [1, 2]


def test_errors_that_nobody_can_measure_are_equal() -> None:
    """A thousandth and a millionth of the least measurable error, in every world; twice that is behind."""
    shape = np.exp(np.random.default_rng(0).normal(0.0, 0.05, 20))
    scores = MEASURABLE * np.array([1e-3 * shape, 1e-6 * shape, 2.0 * shape])
    found = standing(scores, np.zeros(scores.shape, bool), 0)
    assert sorted(found.groups[0]) == [0, 1] and found.groups[1] == [2]
    assert len(standing(scores, np.zeros(scores.shape, bool), 0, floor=1e-15).groups) == 3


def test_an_unstable_law_is_never_called_best() -> None:
    """Ten times better than any other wherever it does not swing, which it does in one world of forty."""
    scores = drawn(4, [0.1, 1.0, 1.0])
    swings = np.zeros(scores.shape)
    assert stand(scores, swings).groups[0] == [0]
    swings[0, 17] = 1.0
    found = stand(scores, swings)
    assert found.unreliable == [0] and sorted(found.groups[0]) == [1, 2]
    assert (found.swings[0].times, found.swings[1].times) == (1, 0) and 0.0 < found.swings[0].low < 1 / 40
    assert stand(scores, swings, tolerated=0.05).groups[0] == [0], "unless whoever asks tolerates it"


@pytest.mark.parametrize(("worlds", "tolerated"), [(250, 0.01), (40, 0.01), (250, 0.05), (60, 0.2), (8, 0.0)])
def test_a_row_loses_its_place_where_its_share_of_lost_worlds_is_shown_to_exceed_what_is_tolerated(
    worlds: int, tolerated: float
) -> None:
    """Failures and swings together, each world once; more failures than tolerated by chance cost no place."""
    scores, outcomes = drawn(5, [1.0, 1.1], worlds), []
    for lost in range(0, worlds // 3, 1 + worlds // 100):
        failing, swings = scores.copy(), np.zeros(scores.shape)
        failing[0, : lost // 2], swings[0, :lost] = np.inf, 1.0
        found = stand(failing, swings, tolerated=tolerated)
        assert (found.lost[0].times, found.failures[0].times) == (lost, lost // 2)
        assert found.swings[0].times == lost - lost // 2, "what fails does not count as a swing too"
        outcomes.append(found.fate(0) == "unreliable")
        assert outcomes[-1] == (share(np.arange(worlds) < lost).low > tolerated)
    assert outcomes == sorted(outcomes) and outcomes[-1] and not outcomes[0]
    assert outcomes.index(True) * (1 + worlds // 100) > tolerated * worlds


def test_of_250_worlds_two_three_and_four_swings_are_told_alike() -> None:
    scores, swings = drawn(11, [1.0, 1.0, 1.0, 1.0], 250), np.zeros((4, 250))
    for row, count in enumerate((2, 3, 4, 12)):
        swings[row, 10 * row : 10 * row + count] = 1.0
    found = stand(scores, swings, tolerated=0.01)
    assert [found.fate(row) for row in range(4)] == ["ranked", "ranked", "ranked", "unreliable"]
    assert found.lost[1].value == 3 / 250 and found.lost[1].low < 0.01 < found.lost[1].high


def test_a_law_that_fails_is_never_called_best_and_what_is_tolerated_costs() -> None:
    scores = drawn(5, [0.25, 1.0, 1.05])
    scores[0, :2] = np.inf, np.nan
    found = stand(scores)
    assert found.unreliable == [0] and found.failures[0].times == 2 and found.groups[0][0] == 1
    tolerant = stand(scores, tolerated=0.05)
    assert tolerant.groups[0] == [0] and not tolerant.unreliable
    assert stand(scores, tolerated=0.05, failure=1e15).groups[0][0] == 1


def test_a_rare_failure_hides_no_large_difference() -> None:
    """One world of forty lost, at 200 times the score: skewness that no series corrects; four times less elsewhere."""
    scores = drawn(15, [0.25, 1.0, 1.02, 1.05, 1.1])
    scores[0, 5] = np.inf
    assert stand(scores, tolerated=0.05).groups[0] == [0]


def test_where_all_are_unreliable_no_group_is_best_and_the_rarest_failures_come_first() -> None:
    scores = drawn(6, [1.0, 1.0, 1.0, 0.5])
    scores[0, :9], scores[1, :2], scores[2, :4], scores[3, :4] = np.inf, np.inf, np.inf, np.inf
    found = stand(scores)
    assert found.groups == [] and found.unreliable == [1, 3, 2, 0] and np.isnan(found.floor)


def test_failures_in_every_world_are_no_error() -> None:
    scores = drawn(7, [1.0, 1.0])
    scores[1] = np.inf
    assert stand(scores).unreliable == [1]


def test_what_does_not_arrive_or_is_not_physical_has_no_place_and_what_fails_is_told_first() -> None:
    scores = drawn(12, [1.0, 0.1, 0.1, 0.1, 0.1])
    scores[4, 0] = np.inf
    found = stand(scores, short=[False, True, False, True, True], unphysical=[False, False, True, True, True])
    fates = ["ranked", "does not arrive", "not physical", "does not arrive", "unreliable"]
    assert [found.fate(row) for row in range(5)] == fates
    assert found.groups == [[0]] and found.order[0] == 0 and sorted(found.order) == list(range(5))


@settings(max_examples=25, deadline=None)
@given(
    st.integers(0, 2**32), st.lists(st.floats(0.5, 2.0), min_size=1, max_size=5), st.permutations(range(5)),
    st.floats(0.01, 100.0), st.integers(1, 15),
)  # fmt: skip
def test_every_row_stands_once_whatever_its_place_and_unit(
    seed: int, factors: list[float], places: list[int], unit: float, worlds: int
) -> None:
    scores, rng = drawn(seed, factors, worlds), np.random.default_rng(seed)
    swings = rng.random(scores.shape) < 0.03
    short, unphysical = rng.random((2, len(factors))) < 0.2
    found = stand(scores, swings, short=short, unphysical=unphysical)
    lists = [*found.groups, found.untold, found.unphysical, found.short, found.unreliable]
    assert sorted(chain(*lists)) == sorted(found.order) == list(range(len(factors)))
    assert all((found.group(row) is None) == (found.fate(row) != "ranked") for row in range(len(factors)))
    means = np.log(np.minimum(scores, RANGE)).mean(axis=1)
    firsts = [group[0] for group in found.groups]
    assert sorted(firsts, key=lambda row: means[row]) == firsts
    order = [place for place in places if place < len(factors)]
    moved = stand(
        unit * scores[order], swings[order], failure=unit * RANGE, short=short[order], unphysical=unphysical[order]
    )
    assert [{order[row] for row in group} for group in moved.groups] == [set(group) for group in found.groups]


def test_a_failure_counts_as_a_right_angle_unless_another_is_said() -> None:
    scores = np.full((2, 40), 0.1)
    scores[1, 0] = np.inf
    found = standing(scores, np.zeros(scores.shape, bool), 0, tolerated=0.5)
    capped = np.where(np.isfinite(scores), scores, FAILURE)
    assert found.floor == standing(capped, np.zeros(scores.shape, bool), 0).floor


@pytest.mark.parametrize("worlds", [8, 13, 40])
def test_the_statistic_of_a_pair_is_halls_transform_of_its_mean_over_its_deviation(worlds: int) -> None:
    """t + g t^2/3 + g^2 t^3/27 + g/(6 n), with the skewness g of a few differences made larger by 6/n, 2 at most."""
    rng = np.random.default_rng(worlds)
    logarithms = np.stack([np.zeros(worlds), rng.gamma(6.0, 0.1, worlds), rng.gamma(0.1, 1.0, worlds)])
    found = PairedComparisons(logarithms, 5)._statistics.T
    for pair, (one, other) in enumerate(((0, 1), (0, 2), (1, 2))):
        differences = logarithms[one] - logarithms[other]
        ratio = differences.mean() / differences.std(ddof=1)
        g = float(np.clip((1.0 + 6.0 / worlds) * skew(differences), -2.0, 2.0))
        wanted = abs(ratio + g * ratio**2 / 3.0 + g**2 * ratio**3 / 27.0 + g / (6.0 * worlds))
        assert found[0, pair] == pytest.approx(wanted, rel=1e-6)


@pytest.mark.parametrize("worlds", [6, 10, 13])
def test_every_flip_of_a_few_worlds_is_tried_once_with_the_first_worlds_sign_as_it_is(worlds: int) -> None:
    """A flip of all signs changes no size: of 2^W flips half are enough."""
    differences = np.random.default_rng(1).standard_normal(worlds)
    found = PairedComparisons(np.stack([differences, np.zeros(worlds)]), 5)._statistics.T
    assert found.shape == (2 ** (worlds - 1), 1) and len(np.unique(found.round(12))) == len(found)
    mirrored = PairedComparisons(np.stack([np.zeros(worlds), differences]), 5)._statistics.T
    np.testing.assert_allclose(np.sort(mirrored, axis=0), np.sort(found, axis=0), atol=1e-12)
