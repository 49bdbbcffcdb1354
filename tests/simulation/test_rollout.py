"""The closed loop: the paper's numbers, independence of lanes, an independent solver, failures."""

from __future__ import annotations

import os
import tracemalloc

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from wristctl.config.loop import LOOPS, Loop, Reference, sample_period
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller
from wristctl.simulation.outcome import Outcome
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout, stream
from wristctl.wrist.compiled_model import linearised
from wristctl.wrist.segments import segments

WRIST = WristParameters()


def run(
    name: str, gains: list[tuple[float, ...]], loop: Loop, *references: Reference, horizon: float = 5.0,
    wrist: WristParameters = WRIST, threads: int = 1,
) -> Outcome:  # fmt: skip
    motions = [motion(r, wrist, horizon, sample_period(loop.control_period)) for r in references]
    which = np.repeat(np.arange(len(motions)), len(gains))
    return rollout(
        controller(name), np.array(gains * len(motions)), motions, which, loop, wrist, record=True, threads=threads
    )


STEP = Reference(kind="step")
MOVES = (Reference(duration=1.0), Reference(duration=2.0))
PRINTED, EXCHANGED = (0.001, 1000.0, 1000.0), (1000.0, 0.001, 1000.0)


def test_printed_gains_move_less_than_a_tenth_of_a_milliradian_in_five_seconds() -> None:
    for loop in (LOOPS["sampled"], LOOPS["four-segments"]):
        moved = run("smc", [PRINTED], loop, STEP).column("theta", 0)
        assert 1e-6 < np.abs(moved).max() < 1e-4


@pytest.mark.slow
def test_exchanged_gains_give_the_papers_rmse_on_an_exact_model_in_nearly_continuous_time_only() -> None:
    exact = run("smc", [EXCHANGED], LOOPS["exact"], *MOVES).metrics["rmse"]
    assert exact == pytest.approx([4.8e-4, 2.1e-4], rel=0.02)
    sampled = run("smc", [EXCHANGED], LOOPS["sampled"], *MOVES).metrics
    assert (sampled["rmse"] > 1.5 * exact).all() and (sampled["saturation"] > 0.9).all()
    default = run("smc", [EXCHANGED], LOOPS["four-segments"], *MOVES).metrics
    assert default["rmse"] == pytest.approx([0.156, 0.082], rel=0.02)
    assert (default["chattering"] > 1e4).all() and (default["steady_state"] < np.deg2rad(0.1)).all()


def bits(outcome: Outcome, index: int) -> bytes:
    assert outcome.samples is not None
    return outcome.samples[index].tobytes() + b"".join(v[index].tobytes() for v in outcome.metrics.values())


@pytest.mark.parametrize("segments_", [1, 4])
@pytest.mark.slow
def test_a_lane_has_the_same_bytes_alone_in_a_batch_and_on_two_threads(segments_: int) -> None:
    rng = np.random.default_rng(0)
    gains = [tuple(row) for row in 10.0 ** rng.uniform([0, -1, 0], [2, 0, 2], (256, 3))]
    loop = Loop(plant_segments=segments_)
    batch = run("smc", gains, loop, MOVES[0], horizon=0.4)
    threaded = run("smc", gains, loop, MOVES[0], horizon=0.4, threads=2)
    for index in (0, 5, 100, 255):
        alone = run("smc", [gains[index]], loop, MOVES[0], horizon=0.4)
        assert bits(alone, 0) == bits(batch, index) == bits(threaded, index)
    assert len({bits(batch, index) for index in range(256)}) == 256


@pytest.mark.slow
def test_rollout_agrees_with_an_independent_implicit_solver() -> None:
    """Four segments under the feedforward torque held over each millisecond, by SciPy's Radau."""
    loop, horizon = LOOPS["four-segments"], 0.3 if os.environ.get("WRISTCTL_THOROUGH") else 0.08
    outcome = run("feedforward", [()], loop, STEP, horizon=horizon)
    plus, minus = (2 * float(outcome.column(f"tension_{side}", 0)[0]) for side in ("plus", "minus"))
    values, n = segments(WRIST, 4), 4

    def slope(t: float, y: np.ndarray, pulls: np.ndarray) -> np.ndarray:
        zero = np.zeros(n)
        rest = linearised(values, y[:n], y[n:], zero, pulls)[0]
        columns = [linearised(values, y[:n], y[n:], unit, pulls)[0] - rest for unit in np.eye(n)]
        return np.concatenate([y[n:], -np.linalg.solve(np.array(columns).T, rest)])

    y, found = np.zeros(2 * n), []
    tensions = np.stack([outcome.column("tension_plus", 0), outcome.column("tension_minus", 0)], axis=1)
    assert np.ptp(tensions, axis=0).max() < 2.0 and plus > minus
    for tick in range(len(tensions) - 1):
        y = solve_ivp(slope, (0, 1e-3), y, "Radau", rtol=1e-8, atol=1e-11, args=(2 * tensions[tick],)).y[:, -1]
        found.append(y[:n].sum())
    assert np.abs(np.array(found) - outcome.column("theta", 0)[1:]).max() < 1e-6
    assert 0.0 < found[-1] < np.deg2rad(30.0)


def test_a_wrist_that_bends_beyond_a_full_turn_is_a_failure_and_spoils_no_other_lane() -> None:
    loop = Loop(plant_segments=1, limits=False)
    tame = (50.0, 1.0)
    outcome = run("computed-torque", [tame, (900.0, 9.0), tame], loop, MOVES[0])
    assert outcome.failed.tolist() == [False, True, False]
    assert np.isnan(outcome.metrics["rmse"][1]) and outcome.metrics["rmse"][0] == outcome.metrics["rmse"][2] < 1e-3
    theta = outcome.column("theta", 1)
    lost = int(np.argmax(np.isnan(theta)))
    assert 0 < lost < len(theta) and np.isnan(theta[lost:]).all() and np.isfinite(theta[:lost]).all()
    assert np.isfinite(outcome.coordinates(1)).all()


def test_the_loop_is_left_right_symmetric() -> None:
    right, left = (
        run("smc", [(30.0, 0.3, 10.0)], LOOPS["four-segments"], Reference(angle_deg=a)) for a in (25.0, -25.0)
    )
    np.testing.assert_allclose(right.column("theta", 0), -left.column("theta", 0), rtol=0, atol=1e-12)
    assert right.metrics["rmse"] == pytest.approx(left.metrics["rmse"], rel=1e-9)
    assert right.metrics["settling"] == pytest.approx(left.metrics["settling"])


def test_substeps_change_the_result_by_less_than_a_microradian() -> None:
    coarse = run("computed-torque", [(50.0, 1.0)], LOOPS["four-segments"], MOVES[0])
    fine = run("computed-torque", [(50.0, 1.0)], Loop(substeps=10), MOVES[0])
    assert np.abs(coarse.column("theta", 0) - fine.column("theta", 0)).max() < 1e-6


def test_a_stream_gives_the_same_metrics_as_one_batch_in_constant_memory() -> None:
    rng = np.random.default_rng(2)
    gains = 10.0 ** rng.uniform([0, -1, 0], [2, 0, 2], (200, 3))
    loop = LOOPS["sampled"]
    followed = motion(MOVES[0], WRIST, 0.2, sample_period(loop.control_period))
    whole = rollout(controller("smc"), gains, [followed], np.zeros(200, np.int64), loop, WRIST)
    parts = stream(controller("smc"), (gains[i : i + 64] for i in range(0, 200, 64)), followed, loop, WRIST)
    streamed = np.concatenate([outcome.metrics["rmse"] for outcome in parts])
    assert streamed.tobytes() == whole.metrics["rmse"].tobytes()

    def peak(batches: int) -> int:
        tracemalloc.start()
        for _ in stream(controller("smc"), (gains for _ in range(batches)), followed, loop, WRIST):
            pass
        _, most = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        return most

    assert peak(20) < 2 * peak(2)
