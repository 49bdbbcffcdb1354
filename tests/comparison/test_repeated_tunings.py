"""Tunings drawn like worlds: intervals hold the truth, ties hold what is alike, and the order is counted rightly."""

from __future__ import annotations

import numpy as np
import pytest

from wristctl.arrays import Array
from wristctl.comparison.repeated_tunings import HALVES, RepeatedTunings, firsts, median_tuning

# Standard deviations of what a tuning, a world, both together and a stream of noise do to a logarithm.
SPREADS = {
    "tunings differ": (0.2, 0.05, 0.1, 0.1),
    "worlds differ": (0.0, 0.3, 0.05, 0.1),
    "both": (0.1, 0.3, 0.1, 0.2),
    "few differ by one alone": (0.3, 0.1, 0.0, 0.0),
}


def errors(
    rng: np.random.Generator, spread: tuple[float, float, float, float], shape: tuple[int, int, int], rows: int = 1
) -> Array:
    """Logarithms of R rows alike, (R, T, W, S): the worlds are the same for all, the tunings are each row's."""
    tunings, worlds, streams = shape
    of_tuning, of_world, of_both, of_stream = spread
    result: Array = (
        of_tuning * rng.standard_normal((rows, tunings, 1, 1))
        + of_world * rng.standard_normal((1, 1, worlds, 1))
        + of_both * rng.standard_normal((rows, tunings, worlds, 1))
        + of_stream * rng.standard_normal((rows, tunings, worlds, streams))
    )
    return result


@pytest.mark.parametrize("spread", SPREADS.values(), ids=SPREADS)
@pytest.mark.parametrize("shape", [(5, 40, 2), (3, 24, 1)])
def test_intervals_hold_the_mean_of_all_tunings_and_worlds(
    spread: tuple[float, float, float, float], shape: tuple[int, int, int]
) -> None:
    rng, trials = np.random.default_rng(1), 200
    held = 0
    for _ in range(trials):
        (mean,) = RepeatedTunings(errors(rng, spread, shape), 1).estimates()
        held += mean.low <= 1.0 <= mean.high
    assert held / trials >= 0.92, "95 % give or take three standard errors of 200"


def test_an_interval_over_worlds_alone_holds_it_far_too_seldom() -> None:
    """Why tunings are drawn: of one tuning each the same errors tell of a certainty that is none."""
    rng, held, trials = np.random.default_rng(2), 0, 100
    for _ in range(trials):
        (mean,) = RepeatedTunings(errors(rng, SPREADS["tunings differ"], (5, 40, 1))[:, :1], 1).estimates()
        held += mean.low <= 1.0 <= mean.high
    assert held / trials < 0.5


def test_two_tunings_tell_no_interval_but_of_what_is_not_tuned() -> None:
    """Student's t with one degree of freedom would allow any error; worlds tell that of a preset all the same."""
    rng = np.random.default_rng(4)
    both = errors(rng, SPREADS["tunings differ"], (5, 40, 1))[:, :2]
    preset = np.repeat(errors(rng, SPREADS["tunings differ"], (5, 40, 1))[:, :1], 2, axis=1)
    tuned, untuned = (repeated := RepeatedTunings(np.concatenate([both, preset]), 1)).estimates()
    assert (tuned.low, tuned.high) == (0.0, np.inf) and 0.0 < untuned.low < untuned.value < untuned.high < np.inf
    assert repeated.ratio(0, 1).is_one and np.isnan(repeated.resolution([0, 1]))
    (three,) = RepeatedTunings(errors(rng, SPREADS["tunings differ"], (5, 40, 1))[:, :3], 1).estimates()
    assert 0.0 < three.low < three.high < np.inf


def test_an_interval_is_as_wide_as_tunings_and_worlds_make_it() -> None:
    """Of tunings alone it is Student's with 4 degrees of freedom, of worlds alone nearly the normal one."""
    rng = np.random.default_rng(3)
    widths = []
    for _ in range(300):
        of_tunings = errors(rng, (0.2, 0.0, 0.0, 0.0), (5, 40, 1))
        (mean,) = RepeatedTunings(of_tunings, 1).estimates()
        widths.append(np.log(mean.high / mean.low) / np.std(of_tunings[0, :, 0, 0], ddof=1))
    assert np.median(widths) == pytest.approx(2.0 * 2.776 / np.sqrt(5.0), rel=0.15)
    of_worlds = errors(rng, (0.0, 0.3, 0.0, 0.0), (5, 400, 1))
    (mean,) = RepeatedTunings(of_worlds, 1).estimates()
    wide = np.std(of_worlds[0, 0, :, 0], ddof=1) / np.sqrt(400.0)
    assert np.log(mean.high / mean.low) == pytest.approx(2.0 * 1.96 * wide, rel=0.1)


def test_what_worlds_have_in_common_does_not_blur_a_ratio() -> None:
    rng = np.random.default_rng(4)
    alike = errors(rng, (0.0, 1.0, 0.0, 0.02), (5, 40, 1), rows=2)
    alike[1] += np.log(1.1)
    repeated = RepeatedTunings(alike, 1)
    ratio = repeated.ratio(1, 0)
    assert ratio.low < 1.1 < ratio.high and ratio.high / ratio.low < 1.03
    inverse = repeated.ratio(0, 1)
    assert (inverse.low, inverse.high) == pytest.approx((1.0 / ratio.high, 1.0 / ratio.low))
    assert repeated.estimates()[0].high / repeated.estimates()[0].low > 1.5
    assert repeated.best([0, 1]) == [0]


@pytest.mark.parametrize("spread", [SPREADS["tunings differ"], SPREADS["both"]], ids=["tunings differ", "both"])
@pytest.mark.slow
def test_a_row_as_good_as_the_best_is_seldom_left_out_and_a_worse_one_is(
    spread: tuple[float, float, float, float],
) -> None:
    rng, left_out, kept = np.random.default_rng(5), 0, 0
    for _ in range(60):
        drawn = errors(rng, spread, (5, 40, 1), rows=6)
        left_out += 0 not in RepeatedTunings(drawn, 1).best(range(6))
        drawn[5] += 2.0
        kept += 5 in RepeatedTunings(drawn, 1).best(range(6))
    assert left_out <= 8 and kept == 0, "3 of 60 are expected at 5 %"


def test_what_is_told_apart_as_a_rule_is_so_when_twice_as_large() -> None:
    drawn = errors(np.random.default_rng(6), SPREADS["both"], (5, 60, 2), rows=3)
    drawn -= drawn.mean(axis=(1, 2, 3), keepdims=True)
    least = RepeatedTunings(drawn, 1).resolution(range(3))
    assert least > 1.05 and np.isnan(RepeatedTunings(drawn, 1).resolution([0]))
    for times, rows in ((2.0, [0]), (0.2, [0, 1, 2])):
        apart = drawn + times * np.log(least) * np.array([0.0, 1.0, 1.0])[:, None, None, None]
        assert sorted(RepeatedTunings(apart, 1).best(range(3))) == rows


def test_firsts_are_counted_over_halves_and_tunings() -> None:
    """Row 1 is best in the last third of the worlds and with the first tuning; row 2 takes no part."""
    drawn = np.zeros((3, 3, 30, 1))
    drawn[1, :, :20] += 1.0
    drawn[1, :, 20:] -= 1.0
    drawn[1, 0] -= 1.5
    drawn[2] -= 9.0
    first, second = firsts(drawn, [0, 1], 1).values()
    assert (first.tunings, second.tunings, first.of_tunings) == (2, 1, 3)
    assert first.halves + second.halves == HALVES and min(first.halves, second.halves) > 0


def test_the_median_tuning_is_never_the_luckiest() -> None:
    assert median_tuning([3.0, 1.0, 2.0]) == 2
    assert median_tuning([1.0, 2.0]) == 1 and median_tuning([2.0, 1.0]) == 0
    assert median_tuning([5.0, 4.0, 1.0, 2.0]) == 1, "of four the third by its error"
    assert median_tuning([1.0]) == 0
