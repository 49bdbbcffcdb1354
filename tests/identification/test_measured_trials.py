"""What is taken from the tables of a run, and what a frame shows."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest

from tests.identification.benches import KNOWN, LEVEL, TENDONS
from wristctl.errors import UserError
from wristctl.identification.measured_trials import MeasuredTrial, measured_trials

GRID, STEP = 1e-3, TENDONS.step_length


def tables(
    rows: int = 60, frames: int = 40, directions: tuple[str, ...] = ("ulnar",), **seen: Any
) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """Trials of 0.3 s that begin 2 s into their own clock, tendon k turning k^2 steps a tick, faster and faster."""
    logs, found, kinds = [], [], []
    for number, direction in enumerate(directions):
        time = 2.0 + 0.005 * np.arange(rows)
        steps = {f"position_{k}": k * k * np.arange(rows) ** 2 for k in (1, 2, 4, 5)}
        logs.append(pd.DataFrame({"trial": number, "time": time, "counted": time + 0.4e-3} | steps))
        captured = np.linspace(2.0, time[-1] - 2.0 * GRID, frames)
        table = {
            "trial": number,
            "captured": captured,
            "used": captured,
            "theta": 0.1 + captured,
            "verdict": "ok",
        } | seen
        found.append(pd.DataFrame(table))
        kinds.append({"trial": number, "direction": direction, "push": 0.0})
    return pd.concat(logs), pd.concat(found), pd.DataFrame(kinds)


def trials(*given: pd.DataFrame, **more: float) -> list[MeasuredTrial]:
    log, frames, kinds = given
    return measured_trials("run", LEVEL, TENDONS, GRID, log, frames, kinds, **more)


def test_spools_are_held_at_what_the_middle_of_each_step_has() -> None:
    """Steps that grow by the square: exact in a cubic, and off by half a corner in chords."""
    (trial,) = trials(*tables())
    ticks = (trial.time + 0.5 * GRID - 2.0 - 0.4e-3) / 0.005
    for column, tendon in enumerate(trial.tendons):
        np.testing.assert_allclose(trial.reeled[:, column], STEP * tendon**2 * ticks**2, atol=1e-9)
    assert trial.tendons == (4, 5, 1, 2) and np.diff(trial.time) == pytest.approx(GRID)
    assert trial.time[0] == 2.0 and trial.time[-1] == pytest.approx(2.0 + 59 * 0.005 - GRID)


def test_a_tick_by_which_no_answer_had_come_says_nothing_of_the_spools() -> None:
    """Its row repeats the board's last positions and their time."""
    log, frames, kinds = tables()
    late = log.copy()
    late.iloc[[20, 21]] = late.iloc[[19, 19]]
    late["time"] = log.time
    lost = log.drop(index=[20, 21])
    for one, other in zip(trials(late, frames, kinds), trials(lost, frames, kinds), strict=True):
        np.testing.assert_array_equal(one.reeled, other.reeled)


def test_trials_keep_their_names_and_their_wrists_lie_in_their_planes() -> None:
    found = trials(*tables(directions=("radial", "flexion")), exposure=4e-3)
    assert [each.label for each in found] == ["run, trial 0: radial", "run, trial 1: flexion"]
    assert [each.planes for each in found] == [("ulnar",), ("flexion",)] and {each.run for each in found} == {"run"}
    assert all(each.exposure == 4e-3 for each in found) and trials(*tables())[0].exposure == 0.0
    np.testing.assert_array_equal(found[0].angle, 0.1 + found[0].captured)


def test_twenty_frames_make_a_trial_and_nineteen_do_not() -> None:
    assert len(trials(*tables(frames=20))[0].angle) == 20
    for few in (tables(frames=19), tables(rows=19), tables(push=1.0)):
        if "push" in few[1]:
            few[2]["push"] = -1.0
        with pytest.raises(UserError, match="no trial without a push has 20 usable frames"):
            trials(*few)
    assert len(trials(*tables(rows=20, frames=25))) == 1


def test_a_short_or_pushed_trial_is_left_out_and_the_next_is_not() -> None:
    log, frames, kinds = tables(directions=("ulnar", "radial", "flexion", "extension"))
    kinds["push"] = [2.0, 0.0, 0.0, 0.0]
    frames = frames[(frames.trial != 1) | (frames.captured < 2.1)]
    log = log[(log.trial != 2) | (log.time < 2.05)]
    assert [each.label for each in trials(log, frames, kinds)] == ["run, trial 3: extension"]


def test_frames_without_an_angle_or_outside_the_log_are_not_used() -> None:
    log, frames, kinds = tables(frames=60)
    lost = frames.assign(verdict=np.where(np.arange(60) % 3 == 0, "jump", "ok"))
    lost.loc[lost.index[1], "theta"] = np.nan
    (trial,) = trials(log, lost, kinds)
    kept = [k for k in range(60) if k % 3 and k != 1]
    np.testing.assert_array_equal(trial.captured, frames.captured.to_numpy()[kept])
    early = frames.assign(captured=frames.captured - 0.1)
    (trial,) = trials(log, early, kinds)
    assert trial.captured.min() >= 2.0 and len(trial.captured) == (early.captured >= 2.0).sum() < 60
    late = frames.assign(captured=frames.captured + 0.1)
    (trial,) = trials(log, late, kinds)
    assert (
        trial.captured.max() <= trial.time[-1] and len(trial.captured) == (late.captured <= trial.time[-1]).sum() < 60
    )


def drawn(exposure: float = 0.0) -> MeasuredTrial:
    time = 1.0 + 0.01 * np.arange(101.0)
    reeled = np.outer((time - 1.0) ** 2, [1.0, 2.0, 3.0, 4.0])
    return MeasuredTrial("", "", "ulnar", KNOWN, time, reeled, np.array([1.2, 1.5, 1.9]), np.zeros(3), exposure)


def test_a_frame_shows_what_was_a_delay_before_its_time_stamp() -> None:
    trial = drawn()
    np.testing.assert_allclose(trial.shown(3.0 * trial.time[:, None], 0.1), 3.0 * (trial.captured - 0.1))
    np.testing.assert_allclose(drawn(0.05).shown(3.0 * trial.time[:, None], -0.05), 3.0 * (trial.captured + 0.05))


def test_an_exposure_lies_evenly_about_the_time_stamp() -> None:
    """Of a square the mean over a time e is the middle's plus e^2/12, of five instants 0.96 of that."""
    fine = 1.0 + 1e-5 * np.arange(100001.0)
    trial = MeasuredTrial("", "", "ulnar", KNOWN, fine, np.zeros((1, 4)), np.array([1.5]), np.zeros(1), 0.2)
    assert trial.shown((fine[:, None] - 1.5) ** 2, 0.0)[0] == pytest.approx(0.96 * 0.2**2 / 12.0, rel=1e-6)
    assert trial.shown((fine[:, None] - 1.5) ** 3, 0.0)[0] == pytest.approx(0.0, abs=1e-9)


def test_a_faster_move_takes_a_fraction_of_the_time_and_then_rests() -> None:
    trial = drawn()
    quick = trial.faster(2.5)
    np.testing.assert_allclose(
        quick.reeled[:41], np.outer((2.5 * (trial.time[:41] - 1.0)) ** 2, [1, 2, 3, 4]), atol=2e-4
    )
    np.testing.assert_allclose(quick.reeled[40:], trial.reeled[-1:].repeat(61, axis=0))
    np.testing.assert_array_equal(quick.captured, trial.captured)
