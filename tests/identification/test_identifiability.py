"""What trials do not tell is refused, and what is said to help does help."""

from __future__ import annotations

import pandas as pd
import pytest

from tests.identification.benches import KNOWN, LEVEL, SLOW, START, TENDONS, UPRIGHT, logged, problem
from wristctl.config.loop import DirectionName
from wristctl.errors import UserError
from wristctl.identification.fit import Fit, fit
from wristctl.identification.identifiability import additions, budget, not_identified, refuse
from wristctl.identification.intervals import Knowledge, knowledge
from wristctl.identification.measured_trials import measured_trials

Slow = tuple[Fit, Knowledge, dict[str, float]]
SIDES: tuple[DirectionName, ...] = ("ulnar", "radial")


@pytest.fixture(scope="module")
def slow() -> Slow:
    """Upright, the default move to both sides: the fit, what it knows, and what it does not."""
    fitted = fit(problem(logged(0, SLOW, (UPRIGHT,), SIDES)[0], widest=0.5))
    known = knowledge(fitted)
    return fitted, known, not_identified(fitted, known)


@pytest.mark.slow
def test_slow_upright_moves_tell_neither_scale_nor_damping_and_the_refusal_says_what_would(slow: Slow) -> None:
    fitted, known, lacking = slow
    assert {"stiffness", "damping"} <= set(lacking)
    offered = additions(fitted, lacking)
    assert any(each.enough for each in offered)
    with pytest.raises(UserError, match=r"stiffness.*condition number.*add .*fix\.") as refused:
        refuse(lacking, offered, known.condition, START)
    assert refused.value.exit_code == 3
    assert next(each.what for each in offered if each.enough) in refused.value.fix


@pytest.mark.slow
def test_what_is_predicted_of_a_faster_move_comes_true(slow: Slow) -> None:
    """Half widths with trials three times as fast added: predicted without them, then found with them.

    They are predicted where the slow trials put the wrist, which tell its damping badly and friction by its dead band
    alone: the order of magnitude holds.
    """
    fitted, _, lacking = slow
    what = "the same moves three times as fast"
    predicted = next(each for each in additions(fitted, lacking) if each.what == what)
    quick, _ = logged(0, SLOW.model_copy(update={"duration": SLOW.duration / 3.0}), (UPRIGHT,), SIDES)
    again = [type(each)(**vars(each) | {"run": "again"}) for each in quick]
    both = fit(problem([*fitted.problem.trials, *again]))
    known = knowledge(both)
    for name in ("damping", "tendon_stiffness", "delay"):
        half = known.half_widths[both.problem.free.index(name)]
        assert 1.0 / 3.0 < half / predicted.half_widths[name] < 3.0, name


@pytest.mark.slow
def test_a_hand_believed_heavier_makes_everything_stiffer_and_leaves_the_delay() -> None:
    """Angles at given spools depend on ratios, so that masses believed 1 % larger scale all the rest by 1 %."""
    trials, _ = logged(1, poses=(LEVEL,), directions=("ulnar",))
    fitted = fit(problem(trials))
    moved = budget(fitted, knowledge(fitted))
    heavier = {
        name: moved["1 % more mass of the hand"][name] + moved["1 % more mass of the wrist"][name]
        for name in fitted.problem.free
    }
    for name in ("stiffness", "damping", "tendon_stiffness"):
        assert heavier[name] == pytest.approx(0.01, rel=0.05)
    assert abs(heavier["delay"]) < 1e-6


def _tables(push: float, verdict: str) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    time = [0.005 * k for k in range(100)]
    steps = {f"position_{tendon}": [tendon * k for k in range(100)] for tendon in (1, 2, 4, 5)}
    log = pd.DataFrame({"trial": 0, "time": time, "counted": [each + 0.5e-3 for each in time]} | steps)
    frames = pd.DataFrame({"trial": 0, "captured": time, "used": time, "theta": 0.1, "verdict": "ok"})
    frames.loc[:49, "verdict"] = verdict
    return log, frames, pd.DataFrame({"trial": [0], "direction": ["extension"], "push": [push]})


def test_trials_take_steps_as_lengths_by_plane_and_only_frames_that_were_seen() -> None:
    wrist = LEVEL.model_copy(update={"gravity": (-1.0, 2.0), "gravity_flexion": 3.0})
    (trial,) = measured_trials("run", wrist, TENDONS, 1e-3, *_tables(0.0, "jump"))
    assert trial.tendons == (2, 5, 1, 4) and trial.wrist.gravity == (-1.0, 3.0)
    assert trial.reeled[100] == pytest.approx([20.0 * TENDONS.step_length * tendon for tendon in (2, 5, 1, 4)])
    assert len(trial.angle) == 49 and trial.captured[0] == pytest.approx(0.25)


def test_a_pushed_trial_is_no_trial_to_identify_from() -> None:
    with pytest.raises(UserError, match="no trial without a push"):
        measured_trials("run", KNOWN, TENDONS, 1e-3, *_tables(2.0, "ok"))
