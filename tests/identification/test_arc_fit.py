"""A real robot's model: it finds what a made robot has, says what it is not told, and predicts."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from wristctl.arrays import Array
from wristctl.identification.arc_fit import ArcFit, by_blocks, fit_arcs
from wristctl.identification.arc_robot import ArcRecording, ArcRobot, window_means
from wristctl.identification.model_choice import chosen_of, tried_models
from wristctl.identification.prediction_scores import ratio_of, score_of
from wristctl.identification.real_robots import TEE_PROBE
from wristctl.wrist.spatial.spatial_kinematics import spatial_backbone, spatial_tips

THIRDS = tuple(k * math.tau / 3.0 for k in range(3))
NECK = ArcRobot((0.1,), THIRDS, 0.05, (1, 1, 1), "bend", ("gain", "tendon", "turn"), {"turn": 0.5})
ARM = ArcRobot((0.09,), THIRDS, 0.01, (1, 1, 1), "tip", ("tendon", "turn"), {})


def made(
    robot: ArcRobot, values: dict[str, float], slack: tuple[float, ...], noise: float, seed: int = 0
) -> ArcRecording:
    """A spiral of a robot with such values, its second half to be predicted."""
    samples = 240
    turn = np.linspace(0.0, 8.0 * math.pi, samples)
    bend = 0.35 * (0.6 + 0.4 * np.sin(0.37 * turn))[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    toward = np.stack([np.cos(robot.angles), np.sin(robot.angles)], axis=1)
    spools = robot.radius * bend @ toward.T + 0.05 * robot.radius
    pause = np.r_[math.nan, np.full(samples - 1, 0.25)]
    first = np.arange(samples) < samples // 2
    nothing, empty = np.zeros(samples, bool), np.zeros((samples, robot.zeros))
    time = 0.25 * np.arange(samples, dtype=np.float64)
    bare = ArcRecording("made", "made", time, spools, empty, pause, first, nothing, ~first,
                        np.arange(samples) // 20)  # fmt: skip
    whole = {name: np.array([value]) for name, value in values.items()}
    zero = np.full((1, robot.zeros), 0.01)
    measured = robot.expected(whole, zero, np.array([slack]), bare)[0][0]
    shaken = measured + noise * np.random.default_rng(seed).normal(size=measured.shape)
    return replace(bare, measured=shaken)


TRUE = {"gain": 1.05, "tendon": 6.0, "turn": 0.8}
SLACK = (4e-4, -3e-4, 6e-4)


def _rooted(slopes: Array) -> tuple[Array, Array]:
    """Slopes by coordinates of unit variance, and the root that makes the unknowns of these."""
    precise, axes = np.linalg.eigh(slopes.T @ slopes)
    root: Array = axes / np.sqrt(precise)
    return slopes @ root, root


def test_scores_of_blocks_have_the_covariance_of_independent_errors_though_the_fit_makes_residuals_smaller() -> None:
    """Residuals of independent errors of unit variance have the covariance 1 - H, which is its own root."""
    slopes, root = _rooted(np.random.default_rng(0).normal(size=(60, 4)))
    blocks = np.repeat(np.arange(6), (4, 16, 10, 10, 5, 15))
    left = np.eye(60) - slopes @ slopes.T
    each = np.array([by_blocks(slopes, column, blocks, root)[0] for column in left])
    np.testing.assert_allclose(np.einsum("ibp,ibq->pq", each, each), np.eye(4), atol=1e-9)


def test_a_mean_of_alike_blocks_has_one_degree_of_freedom_less_than_blocks() -> None:
    slopes, root = _rooted(np.ones((60, 1)))
    _, freedom = by_blocks(slopes, np.zeros(60), np.arange(60) // 5, root)
    assert freedom == pytest.approx([11.0])


def _lag(tendon: float) -> float:
    """Share of what three taut tendons reel in that bends the arc."""
    return 1.5 * tendon / (1.0 + 1.5 * tendon)


def test_what_a_made_robot_has_is_found_with_intervals_that_hold_it() -> None:
    fit = fit_arcs(NECK, ("slack",), [made(NECK, TRUE, SLACK, math.radians(0.1))])
    assert math.degrees(fit.rms()) == pytest.approx(0.14, rel=0.2)
    assert fit.values["turn"] == pytest.approx(0.8, abs=2e-3)
    for name, told in fit.told.items():
        assert not told.known or told.low - 1e-3 < TRUE[name] < told.high + 1e-3, name
    assert fit.told["turn"].known and not fit.told["gain"].known and not fit.told["tendon"].known
    assert fit.values["gain"] * _lag(fit.values["tendon"]) == pytest.approx(1.05 * _lag(6.0), rel=1e-2)
    assert score_of([fit]).error == pytest.approx(fit.rms("asked"))


@pytest.mark.parametrize(
    ("term", "added"),
    [
        ("tendon friction", {"friction": 0.3, "sheath": 0.3, "presliding": 2e-4}),
        ("inner friction", {"inner_friction": 0.06, "inner_presliding": 0.02}),
    ],
)
@pytest.mark.slow
def test_friction_that_a_made_robot_has_is_what_its_data_want(term: str, added: dict[str, float]) -> None:
    recording = made(NECK, TRUE | added, SLACK, math.radians(0.1))
    models = list(tried_models(NECK, [[recording]], False))
    chosen = chosen_of(models)
    assert term in chosen.terms and chosen.score.error < 0.8 * models[1].score.error
    assert next(model for model in models if model.terms[-1:] == (term,)).verdict == "wanted"
    if term == "inner friction":  # while tendons are taut no more is told than how far friction holds the bend
        found = next(model for model in models if model.terms == ("slack", term)).fits[0].values
        held = [x["inner_friction"] / (1.0 + 1.5 * x["tendon"]) for x in (found, TRUE | added)]
        assert held[0] == pytest.approx(held[1], rel=0.15)


@pytest.mark.slow
def test_a_probe_that_stays_bent_while_its_tendons_are_slack_wants_inner_friction() -> None:
    samples = 600
    phase = np.linspace(0.0, 4.0, samples)
    there = np.where(phase < 1.0, phase, np.where(phase < 3.0, 2.0 - phase, phase - 4.0))
    spools = 7e-3 * np.stack([there, -there], axis=1)
    whole, pause = np.ones(samples, bool), np.r_[math.nan, np.ones(samples - 1)]
    time, still = np.arange(samples, dtype=np.float64), np.zeros((samples, 2))
    block = np.arange(samples) // 60
    bare = ArcRecording("loop", "loop", time, spools, still, pause, whole, ~whole, whole, block)
    values = {"gain": 1.6, "tendon": 6.0, "inner_friction": 0.17, "inner_presliding": 0.03}
    robot = TEE_PROBE.robot
    named = {name: np.array([value]) for name, value in values.items()}
    measured = robot.expected(named, np.array([[0.02, 0.0]]), np.array([[2e-3, 1.5e-3]]), bare)[0][0]
    measured[:, 0] += math.radians(0.5) * np.random.default_rng(0).normal(size=samples)
    models = list(tried_models(robot, [[replace(bare, measured=measured)]], False))
    assert all("creep" not in model.terms for model in models)
    chosen = chosen_of(models)
    assert chosen.terms[:2] == ("slack", "inner friction") and math.degrees(chosen.score.error) < 0.6
    assert chosen.fits[0].values["inner_friction"] == pytest.approx(0.17, rel=0.1)
    assert math.degrees(models[0].score.error) > 3.0


def test_a_robot_without_friction_does_not_want_it() -> None:
    shares, fitted = list[float](), list[int]()
    tried = tried_models(NECK, [[made(NECK, TRUE, SLACK, math.radians(0.1))]], False, told=shares.append)
    models = [model for model in tried if not fitted.append(len(shares))]  # type: ignore[func-returns-value]
    assert fitted[:3] == [1, 3, 5], "fits: elastic arcs once, slack from two beginnings, friction too"
    assert shares == sorted(shares) and 0.0 < shares[0] < shares[-1] < 1.0, "of what the data may yet ask for"
    asked = list[float]()
    assert len(list(tried_models(NECK, [[made(NECK, TRUE, SLACK, 0.0)]], False, ("slack",), asked.append))) == 2
    assert asked == [pytest.approx(k / 3) for k in (1, 2, 3)]
    assert not [model for model in models if model.verdict == "wanted" and model.terms[-1] != "slack"]
    assert chosen_of(models).terms in ((), ("slack",))


def test_a_tip_tells_as_a_bend_does_and_a_mean_error_counts_only_where_it_should() -> None:
    recording = made(ARM, {"tendon": 5.0, "turn": 0.4}, SLACK, 1e-4)
    fit = fit_arcs(ARM, ("slack",), [recording])
    assert 1e3 * fit.rms("asked") == pytest.approx(0.17, rel=0.2)
    moved = replace(recording, measured=recording.measured + np.where(recording.asked, 3e-3, 0.0)[:, None])
    shifted = replace(fit, recordings=(moved,))
    centred = replace(fit, recordings=(moved,), centred=True)
    assert score_of([shifted]).error > 5e-3 > 3e-4 > score_of([centred]).error


def test_a_ratio_pairs_blocks_and_its_interval_is_narrow_where_all_blocks_agree() -> None:
    good = fit_arcs(NECK, ("slack",), [made(NECK, TRUE, SLACK, math.radians(0.5))])
    bad = replace(
        good,
        recordings=tuple(
            replace(r, measured=r.measured + 2.0 * e) for r, e in zip(good.recordings, _errors(good), strict=True)
        ),
    )
    ratio = ratio_of([good], [bad])
    assert (ratio.error, ratio.low, ratio.high) == pytest.approx([1.0] * 3, rel=1e-6)
    half = replace(
        good,
        recordings=tuple(
            replace(r, measured=r.measured + 0.5 * e) for r, e in zip(good.recordings, _errors(good), strict=True)
        ),
    )
    assert ratio_of([half], [good])[:3] == pytest.approx([0.5] * 3, rel=1e-6)


def _errors(fit: ArcFit) -> list[Array]:
    """Errors of a fit, before it is changed."""
    return list(fit.errors)


def test_window_means_are_those_of_a_line_and_stay_beyond_its_ends() -> None:
    time = np.arange(0.0, 1.001, 0.01)
    means = window_means(time, np.stack([2.0 * time, 0.0 * time + 3.0], axis=1), np.array([0.2, 0.55, -0.5]), 0.1)
    assert means == pytest.approx(np.array([[0.4, 3.0], [1.1, 3.0], [0.0, 3.0]]), abs=1e-9)


def test_a_motion_is_seen_later_by_a_delay_whether_samples_are_instants_or_means() -> None:
    recording = made(NECK, TRUE, SLACK, 0.0)
    seen = recording.later(recording.spools, 0.25)
    assert seen[1:] == pytest.approx(recording.spools[:-1])
    fine = np.arange(0.0, 60.0, 0.05)
    course = np.stack([np.interp(fine, recording.time, spool) for spool in recording.spools.T], axis=1)
    means = replace(recording, course=(fine, course)).delayed(0.25)
    assert means[20:-20] == pytest.approx(recording.spools[19:-21], abs=2e-4)


def test_arcs_of_unequal_length_end_where_equal_ones_do_when_cut_apart() -> None:
    bends = np.array([0.3, -0.2, 0.45, 0.1])
    halves = np.array([0.15, -0.1, 0.15, -0.1, 0.45, 0.1])
    assert spatial_tips(bends, (0.06, 0.03)) == pytest.approx(spatial_tips(halves, (0.03, 0.03, 0.03)), abs=1e-12)
    assert spatial_tips(halves, 0.09) == pytest.approx(spatial_backbone(halves, 0.09, 3)[-1], abs=1e-12)
