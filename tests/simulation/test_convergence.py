"""Numbers do not depend on the integration step, or are marked."""

from __future__ import annotations

import math
import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from wristctl.api import simulate as simulated
from wristctl.comparison.unknowns_sampling import drawn_settings
from wristctl.config.loop import LOOPS, MOST_SUBSTEPS, Loop, Reference
from wristctl.config.unknowns_box import PaperSetting
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.simulation.convergence import agree, in_doubt, in_one_go, tolerance
from wristctl.simulation.outcome import Outcome
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout, structure
from wristctl.study_files.load import load_study
from wristctl.tuning.objective import Judge
from wristctl.tuning.search import tuning_cases

UNKNOWNS = Path(__file__).parents[2] / "experiments" / "unknowns.yaml"
THOROUGH = bool(os.environ.get("WRISTCTL_THOROUGH"))
NONE = np.zeros(1, np.int64)
BEARS = np.array([58.0])
"""Range of tension of the wrist's tendons [N]."""


def run(law: str, gains: str, loop: Loop, limit: float = 60.0, side: float = 1.0, **how: Any) -> Outcome:
    wrist = WristParameters(tension_limit=limit, length=how.pop("length", 0.08))
    followed = motion(Reference(angle_deg=30.0 * side), wrist, 4.0, max(1e-3, loop.control_period))
    chosen = controller(law)
    return rollout(chosen, np.array([gains_of(chosen, gains)]), [followed], NONE, loop, wrist, record=True, **how)


def missing_deg(outcome: Outcome) -> float:
    return float(np.degrees(outcome.metrics["steady_state"][0]))


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.slow
def test_exchanged_gains_move_the_front_pages_wrist_and_no_step_a_tick_says_so(side: float) -> None:
    """58 N, four segments, 1 kHz: one integration step a tick leaves the wrist where it was."""
    coarse = run("smc", "exchanged", Loop(substeps=1), 58.0, side)
    found = run("smc", "exchanged", LOOPS["four-segments"], 58.0, side)
    fine = run("smc", "exchanged", Loop(substeps=20), 58.0, side)
    assert missing_deg(coarse) > 29.0 and coarse.unconverged.all()
    assert missing_deg(found) < 0.05 and found.steps[0] > 1 and not found.unconverged.any()
    assert found.metrics["rmse"] == pytest.approx(fine.metrics["rmse"], rel=0.02)


@pytest.mark.slow
def test_at_60_newtons_they_arrive_at_every_step_but_one_and_their_rmse_is_marked() -> None:
    found = [run("smc", "exchanged", Loop(substeps=steps)) for steps in (4, 8, 16)]
    own = run("smc", "exchanged", LOOPS["four-segments"])
    assert max(map(missing_deg, [*found, own])) < 0.05
    assert own.unconverged.all() and own.steps == 64 and 0.0 < own.drift[0] < 0.05 * own.metrics["rmse"][0]
    assert own.metrics["rmse"] == pytest.approx(found[0].metrics["rmse"], rel=0.05)


@pytest.mark.slow
def test_beyond_the_threshold_they_move_nothing_at_any_step() -> None:
    for limit in (61.0, 80.0):
        found = run("smc", "exchanged", LOOPS["four-segments"], limit)
        fine = run("smc", "exchanged", Loop(substeps=20), limit)
        assert missing_deg(found) > 29.0 and missing_deg(fine) > 29.0 and not found.unconverged.any()


@pytest.mark.parametrize("law", ["ct-dob", "pid-ff", "feedforward"])
def test_a_smooth_loop_keeps_its_one_step_to_the_bit(law: str) -> None:
    found, one = run(law, "default", LOOPS["four-segments"]), run(law, "default", Loop(substeps=1))
    assert found.steps == 1 and not found.unconverged.any() and not one.unconverged.any()
    assert found.column("theta", 0).tobytes() == one.column("theta", 0).tobytes()


def settings(count: int) -> list[PaperSetting]:
    """Settings that the paper leaves open, at periods of 1 to 10 ms and limits of 40 to 100 N.

    Of few segments one and of many four: the kernels that other tests compile too. Every number of them is thorough.
    """
    rng, found = np.random.default_rng(5), []
    for each in drawn_settings(load_study([UNKNOWNS]).audit.box, WristParameters(), 5):
        if each.measured != "ideal" or each.loop.control_period < 1e-3:
            continue
        cut = each.loop.plant_segments if THOROUGH else 1 if each.loop.plant_segments < 4 else 4
        loop = each.loop.model_copy(update={"limits": True, "plant_segments": cut})
        limit = float(np.exp(rng.uniform(np.log(40.0), np.log(100.0))))
        found.append(each._replace(loop=loop, wrist=each.wrist.model_copy(update={"tension_limit": limit})))
    return found[:count]


@pytest.mark.parametrize("row", [("smc", "exchanged"), ("pid", "printed"), ("smc-tracking", "default")])
@pytest.mark.slow
def test_an_rmse_is_that_of_twenty_times_the_steps_or_marked(row: tuple[str, str]) -> None:
    law, groups = controller(row[0]), dict[tuple[object, ...], list[PaperSetting]]()
    for each in settings(24):
        groups.setdefault(structure(each.loop), []).append(each)
    off = dict.fromkeys(("one", "own"), 0)
    for own in groups.values():
        gains = np.tile(gains_of(law, row[1], None), (len(own), 1))
        motions = [motion(each.reference, each.wrist, 4.0, each.loop.control_period) for each in own]

        def errors(
            steps: int | None, own: list[PaperSetting] = own, gains: Any = gains, motions: Any = motions
        ) -> Outcome:
            loops = [each.loop.model_copy(update={"substeps": steps}) for each in own]
            wrists = [each.wrist for each in own]
            return rollout(law, gains, motions, np.arange(len(own)), loops, wrists)

        fine, free, one = errors(20), errors(None), errors(1)
        for name, found in (("one", one), ("own", free)):
            apart = np.abs(found.metrics["rmse"] - fine.metrics["rmse"])
            wrong = (apart > 2.0 * tolerance(fine.metrics["rmse"])) | (found.failed != fine.failed)
            off[name] += int((wrong & ~(free.unconverged & (name == "own"))).sum())
    assert off["own"] == 0
    assert off["one"] > 0 or row[0] == "smc-tracking"


def test_friction_and_slack_are_no_reason_to_doubt_a_quiet_loop_and_a_swing_is() -> None:
    rig = {"control_period": 5e-3, "actuator": {"level": "tendon", "friction": 0.1}, "sensor": {"level": "camera"}}
    quiet, swinging = (run(*row, Loop.model_validate(rig)) for row in (("ct-dob", "hardware"), ("pid", "printed")))
    assert quiet.steps == 5 and not in_doubt(quiet, np.array([True]), BEARS).any()
    assert in_doubt(swinging, np.array([True]), BEARS).all()
    swings = swinging.metrics["chattering"] / (2.0 * swinging.metrics["peak_tension"])
    assert swings > 2.0
    swinging.step_error[:] = 5.0 * tolerance(swinging.metrics["rmse"])  # a sixth of what puts a quiet loop in doubt
    assert in_doubt(swinging, np.array([True]), BEARS).all()
    swinging.step_error[:] *= 0.1
    assert not in_doubt(swinging, np.array([True]), BEARS).any()
    swinging.step_error[:] *= 10.0
    swinging.metrics["chattering"] = swinging.metrics["chattering"] / swings
    assert in_doubt(swinging, np.array([True]), BEARS).all()
    swinging.metrics["chattering"] = 0.5 * swinging.metrics["chattering"]
    assert not in_doubt(swinging, np.array([True]), BEARS).any()
    swinging.step_error[:] = np.nan
    assert in_doubt(swinging, np.array([True]), BEARS).all()


def test_rollouts_that_differ_beyond_the_tolerance_do_not_agree() -> None:
    one, other = (run("ct-dob", "default", Loop(substeps=1), limit) for limit in (60.0, 60.0))
    assert agree(one, other).all()
    for name, by in (("rmse", np.deg2rad(0.0011)), ("steady_state", np.deg2rad(0.011))):
        other.metrics[name] = one.metrics[name] + by
        assert not agree(one, other).any()
        other.metrics[name] = one.metrics[name] + 0.4 * by
        assert agree(one, other).all()
        other.metrics[name] = np.full(1, np.nan)
        assert not agree(one, other).any(), "a failure is no agreement"
        other.metrics[name] = one.metrics[name]


@pytest.mark.slow
def test_the_best_gains_of_a_search_are_what_they_are_at_a_step_that_is_short_enough() -> None:
    chosen = ["tune.controllers=[pid]", "tune.scenarios=[{loop: four-segments}]", "tune.horizon=3"]
    study, law = load_study([], chosen, "tune"), controller("pid")
    judge = Judge(tuning_cases(study)[0], study.wrist, study.tune.objective)
    gains = 10.0 ** np.random.default_rng(1).uniform([1.0, 0.0, -1.0], [3.5, 2.0, 1.5], (24, 3))
    sure, coarse, told = judge(law, gains), judge.beside(law, gains, -np.inf), judge.beside(law, gains, np.inf)
    assert (np.abs(sure - coarse) > 0.01).sum() > 3, "the step changes some"
    assert told.min() == pytest.approx(sure[told.argmin()], rel=1e-12)
    between = float(np.median(coarse))
    some = judge.beside(law, gains, between)
    assert some.min() == pytest.approx(sure[some.argmin()], rel=1e-12)
    assert some[coarse >= between] == pytest.approx(coarse[coarse >= between], rel=1e-12)


def test_what_is_simulated_says_how_many_steps_it_took_and_whether_they_were_enough() -> None:
    chosen = ["simulate.controller=smc", "simulate.gains=exchanged", "simulate.horizon=3"]
    enough = simulated(load_study([], [*chosen, "wrist.tension_limit=58"], "simulate"))
    short = simulated(load_study([], [*chosen, "wrist.tension_limit=58", "simulate.loop.substeps=1"], "simulate"))
    assert enough.metrics["substeps"] > 1 and enough.metrics["drift"] == 0.0
    assert short.metrics["substeps"] == 1 and short.metrics["drift"] > 0.0


def _summed(excess: list[float], steps: int, swings: float, places: int = 2) -> Any:
    """What `in_one_go` reads of rollouts of 1 deg RMSE, without kinks, whose errors are so many times the limit."""
    count, rmse = len(excess), np.deg2rad(1.0)
    metrics = {"rmse": rmse, "peak_tension": 20.0, "chattering": places * 20.0 * swings}
    return SimpleNamespace(
        metrics={name: np.full(count, value) for name, value in metrics.items()},
        step_error=np.array(excess) * 4.0 * 0.01 * rmse,
        steps=np.full(count, steps),
        places=places,
    )


@pytest.mark.parametrize("steps", [1, 5])
def test_a_rollout_that_cannot_run_again_asks_for_a_power_of_two_of_steps_that_is_twice_its_excess(steps: int) -> None:
    excess = [0.0, 0.99, 1.01, 1.5, 2.5, 7.0]
    doubtful, wanted = in_one_go(_summed(excess, steps, 0.0), np.zeros(len(excess), bool), BEARS)
    assert doubtful.tolist() == [False, False, True, True, True, True]
    assert (wanted[:2] == steps).all() and wanted[2:].tolist() == [4 * steps, 4 * steps, 8 * steps, 16 * steps]
    ratio = wanted[2:] / steps
    assert (ratio >= 2.0 * np.array(excess[2:])).all() and (ratio < 4.0 * np.array(excess[2:])).all()
    kinked, _ = in_one_go(_summed(excess, steps, 0.0), np.ones(len(excess), bool), BEARS)
    assert not kinked.any(), "kinks are taken for errors: eight times as much is borne"


@pytest.mark.parametrize("places", [2, 3, 4, 6])
def test_where_tensions_swing_errors_count_eightfold_and_twice_as_many_steps_again_are_asked_for(places: int) -> None:
    calm, swinging = (
        in_one_go(_summed([0.11, 0.13, 0.3], 2, swings, places), np.zeros(3, bool), BEARS) for swings in (24.0, 26.0)
    )
    assert not calm[0].any() and swinging[0].tolist() == [False, True, True]
    assert swinging[1].tolist() == [2, 2 * 8, 2 * 16]


@pytest.mark.parametrize("places", [2, 3, 4])
def test_with_kinks_errors_count_fortyfold_where_tensions_go_through_all_that_tendons_bear(places: int) -> None:
    found = _summed([0.5, 1.0], 1, 4.0, places)  # 4 times a second to 20 N and back
    bears = 4.0 / 2.0 * 20.0 / 0.8
    one_fold, kinked = 0.5 * 8.0 / 8.0, np.ones(2, bool)
    assert one_fold < 1.0
    for range_, doubtful in ((1.02 * bears, [False, False]), (0.98 * bears, [True, True])):
        assert in_doubt(found, kinked, np.full(2, range_)).tolist() == doubtful, range_
        assert not in_doubt(found, ~kinked, np.full(2, range_))[0], "without kinks nothing of it counts"


def test_of_errors_that_nobody_knows_or_that_are_beyond_all_the_most_steps_are_asked_for() -> None:
    doubtful, wanted = in_one_go(_summed([math.nan, 1e9], 1, 0.0), np.zeros(2, bool), BEARS)
    assert doubtful.all() and wanted[0] == wanted[1] >= 64
    _, most = in_one_go(_summed([math.nan], MOST_SUBSTEPS // 2 + 1, 0.0), np.zeros(1, bool), BEARS)
    assert most[0] == MOST_SUBSTEPS
