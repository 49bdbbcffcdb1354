"""What a fit leaves over tells what the model lacks: each cause is named with its size, and a sound fit names none."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.identification.benches import logged, problem
from wristctl.config.plant import TendonFacts, TrueWrist
from wristctl.errors import UserError
from wristctl.identification.fit import Fit, fit
from wristctl.identification.intervals import Knowledge, interval, knowledge
from wristctl.identification.lack_of_fit import (
    CAUSES,
    Misfit,
    Suspicion,
    misfits,
    refuse_misfit,
    suspicions,
    widened,
)
from wristctl.identification.measured_trials import frame_noise

pytestmark = pytest.mark.slow

Found = tuple[Fit, Knowledge, list[Suspicion], dict[str, float]]


def found(more: Mapping[str, Any] | None = None, **truth: float) -> Found:
    """A fit of two poses' trials in two planes, and what is suspected."""
    trials, values = logged(4, directions=("ulnar", "extension"), more={"noise_deg": 0.02, **(more or {})}, **truth)  # type: ignore[arg-type]
    fitted = fit(problem(trials))
    return fitted, knowledge(fitted), suspicions(fitted), values


@pytest.fixture(scope="module")
def sound() -> Found:
    return found(flexion_ratio=1.15, sheath_friction=0.1)


def test_a_sound_fit_is_not_refused_and_planes_and_sheaths_are_found(sound: Found) -> None:
    fitted, known, suspected, truth = sound
    assert {each.cause for each in suspected} == set(CAUSES) and not any(each.evident for each in suspected)
    refuse_misfit(fitted, known, suspected, misfits(fitted))
    for name in ("flexion_ratio", "sheath_friction", "presliding"):
        low, high = interval(fitted, known, name)
        assert low - 0.3 * (high - low) < truth[name] < high + 0.3 * (high - low), name
    assert fitted.values["flexion_ratio"] == pytest.approx(1.15, abs=0.02)
    assert fitted.values["sheath_friction"] == pytest.approx(0.1, abs=0.01)


@pytest.mark.parametrize(
    ("more", "cause", "size"),
    [
        ({"plant": TrueWrist(creep=0.15)}, "springs that creep", 15.0),
        ({"facts": TendonFacts(creep=0.1)}, "tendons that creep", 10.0),
    ],
)
def test_a_cause_is_named_first_and_its_size_estimated(more: dict[str, Any], cause: str, size: float) -> None:
    fitted, known, suspected, _ = found(more)
    first = suspected[0]
    assert first.cause == cause and first.evident
    assert first.size == pytest.approx(size, abs=max(4.0 * first.deviation, 0.4 * size))
    moved = {
        name: abs(step) / half for (name, step), half in zip(first.shifts.items(), known.half_widths, strict=False)
    }
    if max(moved.values()) > 1.0:
        with pytest.raises(UserError, match=cause) as told:
            refuse_misfit(fitted, known, suspected, misfits(fitted))
        assert told.value.exit_code == 3 and "misfit=tell" in str(told.value)


def test_an_evident_cause_widens_intervals_by_what_it_would_move(sound: Found) -> None:
    fitted, known, _, _ = sound
    shifts = {name: 0.5 * float(half) for name, half in zip(fitted.problem.free, known.half_widths, strict=False)}
    count, nothing = len(shifts), dict.fromkeys(shifts, 0.0)
    chance, evident = (Suspicion("springs that creep", size, 1.0, shifts) for size in (3.0, 5.0))
    assert np.array_equal(widened(known, [chance], nothing).deviation, known.deviation)
    wider = widened(known, [evident], nothing).deviation
    np.testing.assert_allclose(wider[:count], np.hypot(known.deviation[:count], list(shifts.values())))
    np.testing.assert_array_equal(wider[count:], known.deviation[count:])
    finer = widened(known, [], shifts).deviation
    np.testing.assert_allclose(
        finer[:count], np.hypot(known.deviation[:count], 5.0 / 3.0 * np.array(list(shifts.values())))
    )
    against = Suspicion("springs that creep", -9.0, 1.0, shifts)
    assert not against.evident and Suspicion("more damping toward flexion", -9.0, 1.0, shifts).evident


def test_what_would_move_a_parameter_out_of_its_interval_is_refused(sound: Found) -> None:
    fitted, known, _, _ = sound
    half = dict(zip(fitted.problem.free, known.half_widths, strict=False))
    inside, beyond = (
        Suspicion("8 segments", 90.0, 10.0, {name: share * each for name, each in half.items()})
        for share in (0.95, 1.05)
    )
    refuse_misfit(fitted, known, [inside], misfits(fitted))
    with pytest.raises(UserError, match=r"8 segments \(90 \+- 20 % of the way there\)"):
        refuse_misfit(fitted, known, [beyond], misfits(fitted))


def test_residuals_far_above_the_frames_own_noise_are_refused_whatever_is_behind_them(sound: Found) -> None:
    fitted, known, suspected, _ = sound
    fits, fails = (Misfit("ulnar", 300, ratio**0.5 * 1e-3, 1e-3) for ratio in (1.95, 2.05))
    refuse_misfit(fitted, known, suspected, [fits])
    with pytest.raises(
        UserError, match=r"toward ulnar the model is off by 0\.082 deg, frames by 0\.057 deg.*none of the"
    ):
        refuse_misfit(fitted, known, suspected, [fits, fails])


def test_a_model_that_is_off_by_less_than_any_reading_is_not_refused() -> None:
    """Of a simulated log without noise the integration step is left over, smooth from sample to sample."""
    step, camera = (math.radians(factor) for factor in (0.002, 0.02))
    assert Misfit("ulnar", 9000, step, 0.01 * step).ratio < 0.2
    assert Misfit("ulnar", 9000, 3.0 * camera, camera).ratio == pytest.approx(9.0)
    assert Misfit("ulnar", 9000, 2.0 * camera, 0.0).ratio > 2.0


def test_chi_square_is_of_each_direction_by_itself(sound: Found) -> None:
    fitted = sound[0]
    for each in misfits(fitted):
        assert each.ratio == pytest.approx(1.0, abs=0.35) and each.noise == pytest.approx(np.radians(0.02), rel=0.2)
    slow = [0.002 * np.sin(np.linspace(0.0, 9.0, len(each))) for each in fitted.residuals]
    ulnar = [each + more * (trial.direction == "ulnar") for each, more, trial in
             zip(fitted.residuals, slow, fitted.problem.trials, strict=True)]  # fmt: skip
    ratios = {each.direction: each.ratio for each in misfits(replace(fitted, residuals=ulnar))}
    assert ratios["ulnar"] > 5.0 and ratios["extension"] < 1.35


def test_noise_of_frames_does_not_count_moves_trends_and_what_lasts() -> None:
    rng, time = np.random.default_rng(0), np.arange(600) / 60.0
    noise = [1e-3 * rng.standard_normal(600) for _ in range(4)]
    assert frame_noise(noise) == pytest.approx(1e-3, rel=0.08)
    moving = [each + 0.3 * time + 0.02 * np.sin(2.0 * time) for each in noise]
    assert frame_noise(moving) == pytest.approx(frame_noise(noise), rel=0.03)
    quick = [each.copy() for each in noise]
    for each in quick:
        each[100:200] += 0.3 * np.sin(time[100:200] * 30.0)
    assert frame_noise(quick) < 1.5e-3


def test_residuals_that_are_alike_do_not_pass_for_evidence(sound: Found) -> None:
    """A slow error of the camera that no cause makes is not taken for one: its covariance is the sandwich's."""
    fitted, stays = sound[0], 0.97
    evident = 0
    for seed in range(20):
        rng, changed = np.random.default_rng(seed), []
        for each in fitted.residuals:
            lasting = rng.standard_normal(len(each))
            for at in range(1, len(lasting)):
                lasting[at] = stays * lasting[at - 1] + np.sqrt(1.0 - stays**2) * lasting[at]
            changed.append(each + 2.0 * fitted.noise * lasting)
        noise = float(np.sqrt(np.mean(np.concatenate(changed) ** 2)))
        evident += sum(each.evident for each in suspicions(replace(fitted, residuals=changed, noise=noise)))
    assert evident <= 4
