"""Parameters of rehearsed wrists are found, with intervals that hold what they promise."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.identification.benches import KNOWN, LEVEL, TENDONS, UPRIGHT, logged, problem, tendons
from tests.identification.rehearsal import spools
from wristctl.arrays import Array
from wristctl.config.loop import Loop, Reference
from wristctl.control.table import controller
from wristctl.identification.fit import Linearisation, fit, linearise
from wristctl.identification.forward import Supposed, courses
from wristctl.identification.intervals import (
    autocorrelation,
    bandwidth,
    condition,
    inflation,
    knowledge,
    long_run,
)
from wristctl.identification.measured_trials import MeasuredTrial, frame_noise
from wristctl.identification.problem import SPOOL, Coordinate, Problem
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout
from wristctl.simulation.simulated_drives import motor_of
from wristctl.wrist.statics import equilibrium


def test_the_forward_model_repeats_the_closed_loop_from_its_spools() -> None:
    """On the same wrist, driven by the lengths that the loop's motors reeled in."""
    reference = Reference(kind="multi-step", angles_deg=(20.0, -10.0), duration=0.5)
    followed = motion(reference, UPRIGHT, 1.0, 1e-3)
    loop, law = Loop(actuator=TENDONS), controller("feedforward")
    done = rollout(law, np.zeros((1, 0)), [followed], np.zeros(1, np.int64), loop, UPRIGHT, record=True, threads=1)
    reeled = np.repeat(spools(UPRIGHT, reference, TENDONS, 1.0, motor_of(TENDONS)), 2, axis=1)
    found = courses([Supposed(UPRIGHT, TENDONS)], reeled, 1e-3, 4)[0, :, 0]
    assert np.abs(found).max() > 0.3
    np.testing.assert_allclose(found, done.column("theta", 0), rtol=0.0, atol=1e-12)


def test_slack_tendons_leave_the_wrist_to_gravity() -> None:
    wrist = LEVEL.model_copy(update={"stiffness": 0.8})
    slack = np.full((2500, 4), -0.01)
    at_rest = courses([Supposed(wrist, tendons(20e3, 0.1))], slack, 1e-3, 4)[0, -1, 0]
    assert at_rest == pytest.approx(equilibrium(wrist, 4, (0.0, 0.0)).sum(), rel=1e-4)


@pytest.mark.slow
def test_slopes_are_the_differences_of_expected_angles() -> None:
    """By central differences of the whole model, delay, camera's zero and a spool's zero included."""
    trials, _ = logged(0, poses=(UPRIGHT,), directions=("flexion",))
    asked = problem(trials)
    x = asked.begin()
    x[asked.coordinates[Coordinate("delay")]] = 0.0213
    slopes = linearise(asked, x).slopes[0]
    for each, at in asked.coordinates.items():
        size = 1e-6 if each.kind == SPOOL else 1e-4
        nudge = size * (np.arange(len(x)) == at)
        ahead, behind = (linearise(asked, x + side * nudge).expected[0] for side in (1.0, -1.0))
        numeric = (ahead - behind) / (2.0 * size)
        apart = np.linalg.norm(slopes[:, at] - numeric) / np.linalg.norm(numeric)
        assert apart < 0.05, each  # friction that turns round at another moment makes a kink


class _Jumping(Problem):
    """A bend that follows the logarithm of each parameter, and jumps where that of damping is 0.4e-6 or more."""

    def courses(self, trial: MeasuredTrial, points: Sequence[Array]) -> Array:
        x = np.array(points)
        damping = x[:, self.coordinates[Coordinate("damping")]]
        bend = 0.02 * x.sum(axis=1) + 1e-6 * (damping > 0.4e-6)
        return np.repeat(bend[:, None, None], len(trial.time), axis=1)


def test_a_bend_that_jumps_beside_a_point_does_not_change_its_slopes() -> None:
    """As that of a tendon that becomes taut an integration step earlier does: 50 times the slope in a difference."""
    time = 1e-3 * np.arange(100.0)
    still = np.zeros(len(time))
    trial = MeasuredTrial("jump", "jump", "ulnar", KNOWN, time, np.zeros((len(time), 4)), time, still, 0.0)
    plain = problem([trial])
    jumping = _Jumping(plain.trials, plain.start, plain.settings, plain.actuator)
    slopes = linearise(jumping, jumping.begin()).slopes[0]
    columns = [jumping.coordinates[Coordinate(name)] for name in jumping.free if name != "delay"]
    np.testing.assert_allclose(slopes[:, columns], 0.02, rtol=1e-4)


@pytest.mark.slow
def test_softened_springs_and_a_late_camera_are_found() -> None:
    """Stiffness and damping to 5 %, delay to 5 ms."""
    trials, truth = logged(0, directions=("ulnar", "extension"))
    values = fit(problem(trials)).values
    assert values["stiffness"] == pytest.approx(truth["stiffness"], rel=0.05)
    assert values["damping"] == pytest.approx(truth["damping"], rel=0.1)
    assert values["delay"] == pytest.approx(truth["delay"], abs=5e-3)


@pytest.mark.parametrize("factor", [0.25, 2.5])
@pytest.mark.slow
def test_the_search_arrives_from_far_off(factor: float) -> None:
    """With tendons much softer or stiffer than believed."""
    trials, truth = logged(1, poses=(LEVEL,), directions=("ulnar",), tendon_stiffness=factor * 20e3, delay=0.05)
    values = fit(problem(trials)).values
    assert values["tendon_stiffness"] == pytest.approx(truth["tendon_stiffness"], rel=0.1)
    assert values["delay"] == pytest.approx(truth["delay"], abs=5e-3)


@pytest.mark.slow
def test_a_search_that_believes_in_no_friction_leaves_that_edge() -> None:
    trials, truth = logged(0, poses=(UPRIGHT,), directions=("ulnar",))
    known = {name: truth[name] for name in ("damping", "friction", "tendon_radius")}
    assert problem(trials).start["sheath_friction"] == 0.0
    assert fit(problem(trials, fix=known)).values["stiffness"] == pytest.approx(truth["stiffness"], rel=0.05)


@pytest.mark.slow
def test_a_parameter_that_is_held_is_not_found_and_helps_the_others() -> None:
    trials, truth = logged(2, poses=(LEVEL,), directions=("ulnar",))
    free, held = fit(problem(trials)), fit(problem(trials, fix={"tendon_radius": truth["tendon_radius"]}))
    assert held.values["tendon_radius"] == truth["tendon_radius"]
    assert "tendon_radius" not in held.problem.free
    widths = [knowledge(each).half_widths[each.problem.free.index("stiffness")] for each in (free, held)]
    assert widths[1] < 0.5 * widths[0]


def test_residuals_that_are_alike_widen_what_they_tell_of_a_mean() -> None:
    """By (1 + rho)/(1 - rho), the variance of a first-order autoregression's mean over that of white noise."""
    rng, rho = np.random.default_rng(0), 0.6
    ratios = []
    for _ in range(200):
        noise = rng.standard_normal(1000)
        for at in range(1, len(noise)):
            noise[at] += rho * noise[at - 1]
        lags = bandwidth(autocorrelation([noise]), len(noise))
        ratios.append(float(long_run(noise[:, None], lags)[0, 0] / (noise @ noise)))
    assert np.mean(ratios) == pytest.approx((1.0 + rho) / (1.0 - rho), rel=0.15)


def test_a_small_error_that_lasts_is_seen_behind_the_noise_of_single_frames() -> None:
    """Its share of the variance is counted as often as it stays: here 5 %, dying away by 1/e in 20 frames."""
    rng, stays, share = np.random.default_rng(0), np.exp(-1.0 / 20.0), 0.05
    found = []
    for _ in range(300):
        lasting = np.sqrt(share * (1.0 - stays**2)) * rng.standard_normal(1000)
        lasting[0] /= np.sqrt(1.0 - stays**2)
        for at in range(1, len(lasting)):
            lasting[at] += stays * lasting[at - 1]
        found.append(inflation([lasting + np.sqrt(1.0 - share) * rng.standard_normal(1000)], 30))
    lags = np.arange(1, 31)
    assert np.mean(found) == pytest.approx(1.0 + 2.0 * share * ((1.0 - lags / 31.0) * stays**lags).sum(), rel=0.05)


def test_a_picture_shows_the_mean_of_its_exposure() -> None:
    """Of a sine the mean over a time e is sin(w e/2)/(w e/2) of it."""
    (trial, *_), _ = logged(0, poses=(UPRIGHT,), directions=("ulnar",))
    rate, exposure = 2.0 * np.pi * 10.0, 0.02
    within = trial.captured[(trial.captured > 0.1) & (trial.captured < 4.9)]
    seen = replace(trial, exposure=exposure, captured=within).shown(np.sin(rate * trial.time)[:, None], 0.03)
    weaker = np.sin(0.5 * rate * exposure) / (0.5 * rate * exposure)
    assert weaker < 0.95
    np.testing.assert_allclose(seen, weaker * np.sin(rate * (within - 0.03)), rtol=0.0, atol=4e-3)


@pytest.mark.slow
def test_what_the_clocks_may_be_off_by_widens_the_delay_and_nothing_else() -> None:
    trials, _ = logged(0, poses=(UPRIGHT,), directions=("flexion",))
    fitted = fit(problem(trials, clock_error=0.0))
    sure = knowledge(fitted).deviation
    unsure = knowledge(replace(fitted, problem=problem(trials, clock_error=3e-3))).deviation
    at = fitted.problem.coordinates[Coordinate("delay")]
    assert unsure[at] == pytest.approx(np.hypot(sure[at], 3e-3))
    assert np.delete(unsure, at) == pytest.approx(np.delete(sure, at))


def test_the_condition_number_sees_columns_that_point_the_same_way_whatever_their_length() -> None:
    angle = np.radians(3.0)
    slopes = np.array([[1.0, 1e6 * np.cos(angle)], [0.0, 1e6 * np.sin(angle)]])
    assert condition(slopes) == pytest.approx(1.0 / np.tan(angle / 2.0), rel=1e-9)
    assert condition(np.array([[1.0, 0.0], [1.0, 0.0]])) == np.inf


def test_tendons_move_nothing_that_is_not_theirs() -> None:
    """A spool's zero that is off by some length bends the wrist about as its tendon's share of four would."""
    candidates = [Supposed(KNOWN, tendons(20e3, 0.0), taut) for taut in ((0.0,) * 4, (1e-5, 0.0, 0.0, 0.0))]
    straight, bent = courses(candidates, np.full((50, 4), 2e-4), 1e-3, 1)[:, -1, 0]
    assert bent - straight == pytest.approx(1e-5 / (4.0 * KNOWN.tendon_offset), rel=0.05)


SIGMA, FRAMES = 0.01, 400


def made_up(
    monkeypatch: pytest.MonkeyPatch,
    shape: Callable[[float], tuple[float, float]],
    slopes: Callable[[float], tuple[float, float]],
    begins: tuple[float, ...],
    prior: float = 0.0,
) -> Any:
    """A problem of one coordinate x: `shape` of two columns, which are alike in no frame, with white noise on top."""
    rng = np.random.default_rng(0)
    columns, _ = np.linalg.qr(rng.standard_normal((FRAMES, 2)))
    noise = SIGMA * rng.standard_normal(FRAMES)
    noise -= columns @ (columns.T @ noise)

    def at(_: Any, x: np.ndarray) -> Linearisation:
        return Linearisation([columns @ shape(float(x[0]))], [(columns @ slopes(float(x[0])))[:, None]])

    monkeypatch.setattr("wristctl.identification.fit.linearise", at)
    return SimpleNamespace(
        trials=[SimpleNamespace(angle=noise)], free=("x",), prior=lambda: np.array([prior]),
        begins=lambda: [np.array([each]) for each in begins],
        bounds=lambda: (np.array([-10.0]), np.array([10.0])),
    )  # fmt: skip


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_of_two_minima_the_lower_is_the_fit_and_the_other_its_rival(
    side: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two wells at +-1, of which one lies higher by 3 standard deviations of the noise squared."""
    tilt = 1.5 * SIGMA
    asked = made_up(
        monkeypatch, lambda x: (x * x - 1.0, tilt * (x - side)), lambda x: (2.0 * x, tilt), (-3.0, 3.0)
    )  # fmt: skip
    found = fit(asked)
    assert found.x[0] == pytest.approx(side, abs=1e-3)
    assert [rival.x[0] for rival in found.rivals] == [pytest.approx(-side, abs=0.01)]
    assert found.rivals[0].excess == pytest.approx(9.0 * (SIGMA / found.noise) ** 2, rel=0.01)
    assert found.noise == pytest.approx(SIGMA, rel=0.1)
    assert found.evaluations > 10


def test_searches_that_end_in_one_minimum_have_no_rival(monkeypatch: pytest.MonkeyPatch) -> None:
    found = fit(made_up(monkeypatch, lambda x: (x - 2.0, 0.0), lambda x: (1.0, 0.0), (-3.0, 0.0, 5.0)))
    assert found.x[0] == pytest.approx(2.0, abs=1e-6) and found.rivals == ()


def test_a_beginning_that_leads_far_higher_goes_no_further_and_is_no_rival(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = made_up(monkeypatch, lambda x: (x * x - 1.0, 0.1 * (x - 1.0)), lambda x: (2.0 * x, 0.1), (-3.0, -2.0, 3.0))
    found = fit(asked)
    assert found.x[0] == pytest.approx(1.0, abs=1e-3)
    assert found.rivals == () and found.evaluations < 60


def test_what_is_known_beforehand_counts_by_its_deviation_beside_the_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    """Readings say 1 +- sigma, it was known as 0 +- 2 sigma: between them as the inverse variances have it."""
    asked = made_up(monkeypatch, lambda x: (x - 1.0, 0.0), lambda x: (1.0, 0.0), (0.5,), prior=1.0 / (2.0 * SIGMA))
    found = fit(asked)
    readings, known = 1.0 / found.noise**2, 1.0 / (2.0 * SIGMA) ** 2
    assert found.x[0] == pytest.approx(readings / (readings + known), rel=0.09)
    (left,) = found.residuals
    assert found.noise == pytest.approx(np.sqrt(left @ left / (FRAMES - 1)), rel=1e-6)


def test_the_noise_of_frames_is_told_from_any_slow_course() -> None:
    """Of each, white noise of 2 mrad; a jump is one frame of many."""
    rng = np.random.default_rng(1)
    time = np.linspace(0.0, 5.0, 3000)
    course = np.sin(time) + 3.0 * time + (time > 2.0)
    white = [2e-3 * rng.standard_normal(3000) for _ in range(2)]
    assert frame_noise(white) == pytest.approx(2e-3, rel=0.05)
    assert frame_noise([course + each for each in white]) == pytest.approx(frame_noise(white), rel=0.01)
