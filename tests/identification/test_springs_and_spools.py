"""Springs of two planes by their mean and ellipse, and spools that a bench would be told to follow."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.identification.bend_rehearsal import Hold, planned_spools
from wristctl.config.plant import Actuator
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.identification import bend_estimates
from wristctl.identification.unknowns import oblique_of, springs_of
from wristctl.wrist.tendon_layout import TendonLayout

WRIST = WristParameters(gravity=(0.0, 0.0))
TENDONS = Actuator(level="tendon")
LAYOUT = TendonLayout.of(WRIST)


@pytest.mark.parametrize("ratio", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("axis", [0.0, 30.0, 45.0, 90.0, -60.0])
def test_springs_are_a_mean_and_twice_the_axis_around_a_circle(ratio: float, axis: float) -> None:
    """Mean of both, and (1 - r)/(1 + r) of it more along the axis: with its cosine and sine at twice the angle."""
    wrist = WRIST.model_copy(update={"stiffness": 0.8, "flexion_ratio": ratio, "stiffness_axis_deg": axis})
    mean, p, q = oblique_of(wrist)
    size, twice = (1.0 - ratio) / (1.0 + ratio), math.radians(2.0 * axis)
    assert mean == pytest.approx(0.4 * (1.0 + ratio))
    assert (p, q) == pytest.approx((size * math.cos(twice), size * math.sin(twice)), abs=1e-12)


@pytest.mark.parametrize(("ratio", "axis"), [(0.5, 30.0), (2.0, 30.0), (1.5, -40.0), (0.9, 0.0)])
def test_an_axis_within_45_degrees_of_ulnar_comes_back_and_another_as_the_one_across(ratio: float, axis: float) -> None:
    for turned in (axis, axis + 90.0, axis - 180.0):
        swapped = turned == axis + 90.0
        own = (
            {"stiffness": 0.8 * ratio, "flexion_ratio": 1.0 / ratio}
            if swapped
            else {"stiffness": 0.8, "flexion_ratio": ratio}
        )
        found = springs_of(*oblique_of(WRIST.model_copy(update=own | {"stiffness_axis_deg": turned})))
        assert found == pytest.approx({"stiffness": 0.8, "flexion_ratio": ratio, "stiffness_axis_deg": axis}, abs=1e-9)


def test_planned_spools_go_smoothly_from_hold_to_hold_and_stay_there() -> None:
    """Each begins where the one before has ended; bends to opposite sides are mirrored, and straight has no side."""
    holds = [Hold(20.0, 0.0), Hold(20.0, 180.0), Hold(0.0, 0.0), Hold(20.0, 0.0)]
    counts = planned_spools(WRIST, TENDONS, LAYOUT, holds, hold=0.6)
    assert counts.shape == (2400, 4) and (counts == np.rint(counts)).all()
    assert np.abs(np.diff(counts, axis=0)).max() * 1e3 < TENDONS.step_rate
    ends = counts[599::600]
    np.testing.assert_array_equal(counts[::600][1:], ends[:-1])
    assert (np.abs(counts[590:600] - ends[0]) == 0.0).all(), "it is held at its end"
    np.testing.assert_array_equal(ends[3], ends[0])
    assert np.abs(ends[1] - ends[0][[2, 3, 0, 1]]).max() <= 1.0, "1 and 2 lie opposite 4 and 5"
    plus = np.array([number in (4, 5) for number in (1, 2, 4, 5)])
    reeled = ends[0] * TENDONS.step_length
    bend = math.radians(20.0)
    assert reeled[plus] - reeled[~plus] == pytest.approx(2.0 * bend * WRIST.tendon_offset, rel=0.05)
    assert np.ptp(ends[2]) <= 1.0


def test_a_tighter_hold_reels_in_by_its_pull_over_the_tendons_stiffness() -> None:
    tight = planned_spools(WRIST, TENDONS, LAYOUT, [Hold(0.0, 0.0, 1.0), Hold(0.0, 0.0, 5.0)], hold=0.6)
    more = (tight[-1] - tight[599]) * TENDONS.step_length
    assert more == pytest.approx(4.0 * WRIST.pretension / TENDONS.tendon_stiffness, abs=1.5 * TENDONS.step_length)
    loose = planned_spools(WRIST, TENDONS, LAYOUT, [Hold(20.0, 0.0, 1.0), Hold(20.0, 0.0, 0.0)], hold=0.6)
    less = (loose[599] - loose[-1]) * TENDONS.step_length
    assert (less[:2] > 1.5e-3).all() and (less[2:] < 0.5e-3).all(), "those that do not pull are let go"


def test_a_move_that_motors_cannot_make_in_time_is_refused() -> None:
    """A minimum jerk over a distance d peaks at 5.77 d/T^2, of which the motors' own acceleration is 1.25 times."""
    holds = [Hold(20.0, 0.0)]
    reeled = np.abs(planned_spools(WRIST, TENDONS, LAYOUT, [*holds, *holds], hold=2.0)[[0, -1]])
    furthest = float(np.abs(reeled[1] - reeled[0]).max())
    needed = math.sqrt(5.7735 * furthest / (0.8 * TENDONS.step_acceleration))
    planned_spools(WRIST, TENDONS, LAYOUT, holds, hold=1.05 * needed)
    with pytest.raises(UserError, match="takes the motors"):
        planned_spools(WRIST, TENDONS, LAYOUT, holds, hold=0.95 * needed)


@pytest.mark.parametrize(("axis", "other", "known"), [(20.0, 20.0, True), (20.0, 20.6, False), (20.0, -20.0, False),
                                                      (-44.9, 45.0, True), (30.0, 120.0, True)])  # fmt: skip
def test_an_axis_is_told_only_where_another_minimum_has_it_too(
    axis: float, other: float, known: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An axis and the one across it are the same ellipse's. Of a size of 0.3 and errors of 1e-3: 0.19 deg to a side."""
    free = ("stiffness", "oblique_cos", "oblique_sin")

    def springs(at: float) -> np.ndarray:
        return np.array([0.6, 0.3 * math.cos(2.0 * math.radians(at)), 0.3 * math.sin(2.0 * math.radians(at))])

    def values(x: np.ndarray) -> dict[str, float]:
        return dict(zip(free, x.tolist(), strict=True))

    monkeypatch.setattr(bend_estimates, "covariance_of", lambda fit, knowledge: 1e-6 * np.eye(3))
    asked: Any = SimpleNamespace(free=free, values=values, settings=SimpleNamespace(widest=0.3))
    fit: Any = SimpleNamespace(problem=asked, values=values(springs(axis)))
    told = bend_estimates._springs_told(fit, fit, [springs(other)])["stiffness_axis_deg"]
    assert told.value == pytest.approx(axis) and told.known == known
    if known:
        assert told.high - told.value == pytest.approx(math.degrees(1.96e-3 / 0.6), rel=1e-3)
