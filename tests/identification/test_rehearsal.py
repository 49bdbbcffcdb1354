"""The tables of a rehearsed bench: clocks, steps, and what its camera shows of the wrist."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from tests.identification import rehearsal
from tests.identification.benches import LEVEL, STEPS, TENDONS
from tests.identification.rehearsal import RehearsedTruth, rehearse
from wristctl.config.loop import DirectionName, Reference
from wristctl.config.plant import Actuator, TendonFacts, TrueActuator, TrueWrist
from wristctl.errors import UserError
from wristctl.identification.forward import Supposed, across_plane, courses
from wristctl.simulation.reference import toward
from wristctl.simulation.simulated_drives import motor_of
from wristctl.wrist.directions import DIRECTIONS, in_plane

pytestmark = pytest.mark.slow

SOFT = LEVEL.model_copy(update={"stiffness": 0.4, "gravity": (-3.0, 5.0), "gravity_flexion": -2.0})
TRUE = RehearsedTruth(SOFT, TENDONS, delay=0.02, noise_deg=0.0, exposure=0.0, dropped=0.0)
MOVES: tuple[tuple[DirectionName, Reference], ...] = (("radial", STEPS), ("flexion", STEPS))
MOTOR = motor_of(TENDONS)
Tables = tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]


def rehearsed(
    truth: RehearsedTruth = TRUE, seed: int = 0, moves: Sequence[tuple[DirectionName, Reference]] = MOVES
) -> Tables:
    return rehearse(LEVEL, TENDONS, truth, moves, 5.0, np.random.default_rng(seed))


def of(table: pd.DataFrame, trial: int, name: str) -> np.ndarray:
    return table[table.trial == trial][name].to_numpy()


def test_the_log_has_a_line_every_5_ms_with_steps_counted_half_a_tick_later() -> None:
    log, _, kinds = rehearsed()
    np.testing.assert_allclose(of(log, 1, "time"), 0.005 * np.arange(1000), atol=1e-12)
    np.testing.assert_allclose(log.counted - log.time, 5e-4)
    assert kinds.to_dict("list") == {"trial": [0, 1], "direction": ["radial", "flexion"], "push": [0.0, 0.0]}


def test_both_tendons_of_a_side_turn_alike_and_the_steps_are_what_the_motors_reeled_in() -> None:
    log, _, _ = rehearsed()
    for number, (plus, minus) in enumerate((((4, 5), (1, 2)), ((2, 5), (1, 4)))):
        direction = MOVES[number][0]
        reeled = rehearsal.spools(in_plane(LEVEL, direction), toward(STEPS, direction), TENDONS, 5.0, MOTOR)[::5]
        for side, tendons in enumerate((plus, minus)):
            for tendon in tendons:
                steps = of(log, number, f"position_{tendon}")
                np.testing.assert_allclose(
                    steps * TENDONS.step_length, reeled[:, side], atol=0.5001 * TENDONS.step_length
                )
        assert np.ptp(of(log, number, f"position_{plus[0]}")) > 100


def test_pictures_come_at_the_frame_rate_from_any_moment_on_and_are_used_10_ms_later() -> None:
    begun = []
    for seed in range(12):
        _, frames, _ = rehearsed(replace(TRUE, frame_rate=50.0), seed, MOVES[:1])
        captured = frames.captured.to_numpy()
        assert np.diff(captured) == pytest.approx(0.02) and 4.98 <= captured[-1] < 5.0
        begun.append(captured[0])
        np.testing.assert_allclose(frames.used - frames.captured, 0.01)
    assert 0.0 <= min(begun) < 0.007 and 0.013 < max(begun) < 0.02


def test_pictures_show_the_true_wrist_a_delay_ago_and_the_markers_zero_of_its_plane() -> None:
    truth = replace(TRUE, zero_deg=(3.0, -5.0), taut=(1e-4, -2e-4, 3e-4, -4e-4))
    _, frames, _ = rehearsed(truth)
    taut = {"radial": (3e-4, -4e-4, 1e-4, -2e-4), "flexion": (-2e-4, -4e-4, 1e-4, 3e-4)}
    for number, (direction, zero) in enumerate((("radial", 3.0), ("flexion", -5.0))):
        reeled = rehearsal.spools(in_plane(LEVEL, direction), toward(STEPS, direction), TENDONS, 5.0, MOTOR)  # type: ignore[arg-type]
        soft, plane = in_plane(SOFT, direction), DIRECTIONS[direction].plane
        across = across_plane(soft, plane, SOFT.stiffness, SOFT.flexion_ratio)
        own = Supposed(soft, TENDONS, taut[direction], across=across)
        course = courses([own], np.repeat(reeled, 2, axis=1), 1e-3, 4)[0, :, 0]
        then = of(frames, number, "captured") - 0.02
        wanted = np.interp(then, 1e-3 * np.arange(5000), course) + np.radians(zero)
        np.testing.assert_allclose(of(frames, number, "theta"), wanted, atol=1e-12)
        assert np.ptp(course) > 0.3


def test_noise_and_losses_are_as_large_as_told_and_exposure_blurs_about_the_time_stamp() -> None:
    _, sharp, _ = rehearsed(moves=MOVES[:1] * 4)
    _, noisy, _ = rehearsed(replace(TRUE, noise_deg=0.5, dropped=0.3), moves=MOVES[:1] * 4)
    lost = noisy.verdict.to_numpy() == "no tip"
    assert lost.mean() == pytest.approx(0.3, abs=0.05) and set(noisy.verdict[~lost]) == {"ok"}
    assert np.isnan(noisy.theta[lost]).all() and np.isfinite(noisy.theta[~lost]).all()
    first = noisy[noisy.trial == 0], sharp[sharp.trial == 0]
    error = np.degrees(first[0].theta - first[1].theta)
    assert error.std() == pytest.approx(0.5, rel=0.15) and abs(error.mean()) < 0.1
    _, blurred, _ = rehearsed(replace(TRUE, exposure=0.2), moves=MOVES[:1])
    fine = np.array([np.interp(sharp.captured[sharp.trial == 0] + shift, first[1].captured, first[1].theta)
                     for shift in np.linspace(-0.1, 0.1, 81)]).mean(axis=0)  # fmt: skip
    inner = slice(10, -10)
    np.testing.assert_allclose(blurred.theta.to_numpy()[inner], fine[inner], atol=4e-3)
    assert np.abs(blurred.theta.to_numpy() - first[1].theta.to_numpy()).max() > 0.02


def test_a_bench_is_late_and_imperfect_unless_told_otherwise() -> None:
    """A camera of 60 pictures a second, 30 ms late, open for 4 ms, that loses one in twenty."""
    plain = RehearsedTruth(LEVEL, TENDONS)
    assert (plain.frame_rate, plain.delay, plain.exposure, plain.dropped, plain.noise_deg) == (
        60.0,
        0.03,
        4e-3,
        0.05,
        0.05,
    )


LATE, STOPPED = {"creep": 0.1}, {"end_stop_deg": 12.0}
WITH: dict[str, dict[str, Any]] = {
    "plant.creep_time": LATE, "plant.end_stop_stiffness": STOPPED, "plant.end_stop_dissipation": STOPPED,
    "facts.creep_time": LATE, "facts.slip": {"slips_at": 0.2, "slip": 1e-4}, "plant.taper": {"model": "hinges"},
    "plant.flexion_ratio": {}, "actuator.presliding": {}, "plant.inner_presliding_deg": {"inner_friction": 0.02},
    "plant.stiffness_axis_deg": {"flexion_ratio": 1.3},
}  # fmt: skip
"""What a leaf needs beside it to mean anything."""
OTHERS: dict[str, Any] = {
    "plant.model": "hinges", "plant.end_stop_deg": 12.0, "facts.broken_at": 0.2, "facts.slips_at": 0.2,
    "facts.backlash": 3e-4, "plant.tilt_deg": 10.0, "plant.payload": 0.2, "actuator.step_rate": 2e3,
    "actuator.ramp": 5e3,
    "plant.stiffness_axis_deg": 30.0,
}  # fmt: skip
NOT_OF_TENDONS = {"lag", "torque", "corner_speed", "top_speed", *TendonFacts.model_fields}
"""Of motors with a lag, of a motor that falls back, and what `facts` say."""
OF_TWO_PLANES = "slack", "broken_tendon", "slipping_tendon"
LEAVES = [
    *(f"plant.{name}" for name in TrueWrist.model_fields if not name.endswith("_spread")),
    *(f"facts.{name}" for name in TendonFacts.model_fields if name not in OF_TWO_PLANES),
    *(f"actuator.{name}" for name in TrueActuator.model_fields.keys() - NOT_OF_TENDONS),
    *(each for each in ("delay", "noise_deg", "zero_deg", "taut", "frame_rate", "exposure", "dropped", "segments")),
]


def changed(section: Any, name: str, number: float = 1.3) -> Any:
    """Another value of one leaf."""
    value = getattr(section, name)
    if isinstance(value, tuple):
        return tuple(each + 1e-3 for each in value)
    if isinstance(value, int):
        return value - 2
    return "x1.3" if value is None else number * value + 0.1 * (value == 0.0)


@pytest.mark.parametrize("leaf", sorted(LEAVES))
def test_every_leaf_of_a_rehearsed_truth_shows_in_its_recording(leaf: str) -> None:
    """A perfect camera, and one move of which friction and the motors' speed have to do."""
    base = replace(TRUE, exposure=0.01)
    name = leaf.split(".")[-1]
    if "." in leaf:
        kind = leaf.split(".")[0]
        section = getattr(base, kind).model_copy(update=WITH.get(leaf, {}))
        base = replace(base, **{kind: section})
        value = OTHERS[leaf] if leaf in OTHERS else changed(section, name)
        truth = replace(base, **{kind: type(section).model_validate(section.model_dump() | {name: value})})
    else:
        truth = replace(base, **{name: changed(base, name)})
    direction: DirectionName = "flexion" if name in ("flexion_ratio", "zero_deg") else "ulnar"
    moves = ((direction, Reference(kind="multi-step", angles_deg=(25.0, -20.0), duration=0.5)),)
    one, other = (
        rehearse(LEVEL, TENDONS, each, moves, 1.0, np.random.default_rng(0))[1].theta for each in (base, truth)
    )
    assert len(one) != len(other) or not np.allclose(one, other, rtol=0.0, atol=2e-6, equal_nan=True)


def test_backlash_is_a_dead_band_of_the_spools() -> None:
    """Where the motors turn round, the angle waits until they have crossed it: the loop is wider by about b/c."""
    moves = (("ulnar", Reference(kind="sine", frequency=0.25, angle_deg=25.0)),)
    bare = TENDONS.model_copy(update={"friction": 0.0})
    lag = []
    for backlash in (0.0, 3e-4):
        truth = replace(TRUE, actuator=bare, delay=0.0, facts=TendonFacts(backlash=backlash))
        log, frames, _ = rehearse(LEVEL, TENDONS, truth, moves, 4.0, np.random.default_rng(0))  # type: ignore[arg-type]
        turned = np.interp(frames.captured, log.time, log.position_4 * TENDONS.step_length)
        there = (turned > 0.4 * turned.max()) & (turned < 0.6 * turned.max())
        rising = frames.captured < 2.0
        slope = np.polyfit(turned, frames.theta, 1)[0]
        away = frames.theta - slope * turned
        lag.append(float(away[there & ~rising].mean() - away[there & rising].mean()))
    assert lag[1] - lag[0] == pytest.approx(3e-4 / LEVEL.tendon_offset, rel=0.35)


@pytest.mark.parametrize("wrong", [{"plant": TrueWrist(payload_spread=0.1)}, {"actuator": Actuator(level="lagged")}])
def test_a_truth_that_no_rehearsal_has_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(UserError):
        RehearsedTruth(**({"wrist": LEVEL, "actuator": TENDONS} | wrong))
