"""Simulated runs as open logs: spools as they stood, and identification that finds what was simulated."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import wristctl
from wristctl.commands.export.recorded_motions import motions_of
from wristctl.commands.export.run_data import open_log_of
from wristctl.config.identify import IdentifySettings
from wristctl.config.plant import Actuator
from wristctl.config.wrist import WristParameters
from wristctl.identification.arc_fit import fit_arcs
from wristctl.identification.bend_estimates import told_of_bends
from wristctl.identification.fit import fit
from wristctl.identification.forward import courses
from wristctl.identification.intervals import knowledge
from wristctl.identification.lack_of_fit import misfits
from wristctl.identification.log_model import everything_fitted, recordings_of_logs, robot_of_logs
from wristctl.identification.measured_trials import places_of_log, trials_of_logs
from wristctl.identification.model_choice import chosen_of, tried_models
from wristctl.identification.problem import bend_problem
from wristctl.records import Run, start_run
from wristctl.records.open_log import OpenLog
from wristctl.wrist.tendon_layout import TendonLayout

WRIST, TENDONS = WristParameters(), Actuator(level="tendon")
MOTORS = "simulate.loop.actuator.level=tendon"
# Motors as fast as those, with microsteps of an eighth: a log says where spools stand each millisecond, and not when
# within it they have stepped, which moves the wrist by more than these tests' noise.
SMOOTH = tuple(
    f"simulate.loop.actuator.{name}={8 * getattr(TENDONS, name):g}"
    for name in ("microstep", "step_rate", "step_acceleration", "ramp")
)


def simulated(out: Path, *settings: str) -> OpenLog:
    """The open log of a simulated run."""
    run = wristctl.simulate(wristctl.load_study(None, *settings), out=out).run
    assert run is not None
    return open_log_of(Run(run.path))


def seen(log: OpenLog, noise_deg: float, every: int, seed: int = 0) -> OpenLog:
    """The log as a camera has it: bends of some samples, with noise."""
    rng, kept = np.random.default_rng(seed), np.arange(len(log)) % every == 0
    noisy = {
        name: np.where(kept, column + math.radians(noise_deg) * rng.normal(size=len(log)), math.nan)
        for name, column in log.columns.items()
        if name.startswith("bend")
    }
    return replace(log, columns={**log.columns, **noisy})


@pytest.mark.slow
def test_spools_of_a_simulated_run_stand_where_tendons_pull_as_recorded(tmp_path: Path) -> None:
    free = simulated(tmp_path, MOTORS, "simulate.loop.actuator.friction=0", "simulate.controller=feedforward")
    bend = free.columns["bend_y"]
    assert set(free.tendons("spool")) == {1, 2, 4, 5} and bend[-1] > 0.4
    for number, side in ((4, 1.0), (5, 1.0), (1, -1.0), (2, -1.0)):
        spool, tension = free.columns[f"spool_{number}"], free.columns[f"tension_{number}"]
        # a taut tendon's spool has reeled in its stretch and the side's shortening, about the offset times the bend
        shorter = spool - tension / TENDONS.tendon_stiffness
        taut = tension > 0.1
        np.testing.assert_allclose(shorter[taut], side * WRIST.tendon_offset * bend[taut], atol=1e-4)
    rubbing = simulated(tmp_path, MOTORS, "simulate.controller=feedforward")
    assert set(rubbing.tendons("spool")) == {1, 2, 4, 5} and not rubbing.tendons("tension")
    assert not simulated(tmp_path, "simulate.controller=feedforward").tendons("spool")


@pytest.mark.slow
def test_a_simulated_plane_is_found_again_from_its_log(tmp_path: Path) -> None:
    motion = "simulate.reference={kind: two-sided-sine, frequency: 0.3, angle_deg: 15.0}"
    settings = (MOTORS, motion, "simulate.loop.actuator.friction=0", "simulate.loop.plant_segments=1",
                "wrist.gravity=[0, 0]", "simulate.controller=feedforward", "simulate.horizon=7")  # fmt: skip
    log = seen(simulated(tmp_path, *settings), 0.02, 1)
    robot = robot_of_logs([log], WRIST, 0.01)
    recordings = recordings_of_logs([log], robot)
    chosen = chosen_of(list(tried_models(robot, [recordings], False)))
    told = fit_arcs(robot, chosen.terms, everything_fitted(recordings), begin=chosen.fits[0].values).told
    truth = {
        "tendon": TENDONS.tendon_stiffness * WRIST.tendon_radius**2 / WRIST.stiffness,
        "damping": WRIST.damping / WRIST.stiffness,
    }
    truth |= {"gain": 1.0, "force": WRIST.stiffness}
    for name, value in truth.items():
        half = 0.5 * (told[name].high - told[name].low)
        assert told[name].known and told[name].value == pytest.approx(value, abs=1.5 * half), name
        assert half < 0.01 * value, name
    assert told["delay"].low <= 0.0 < told["delay"].high < 2e-3


@pytest.mark.slow
def test_a_simulated_wrist_in_two_planes_is_found_again_from_its_log(tmp_path: Path) -> None:
    motion = ("simulate.reference.kind=circumduction", "simulate.controller=pd-ff")
    whole = simulated(tmp_path, MOTORS, *SMOOTH, *motion)
    assert set(whole.tendons("spool")) == {1, 2, 4, 5} and not whole.tendons("tension")
    log, search = seen(whole, 0.003, 4, seed=2), IdentifySettings()
    believed = WRIST.model_copy(update={"stiffness": 0.9 * WRIST.stiffness, "damping": 1.15 * WRIST.damping})
    motors = TENDONS.model_copy(update={"tendon_stiffness": 1.1 * TENDONS.tendon_stiffness})
    trials = trials_of_logs([log], believed, search.step)
    found = fit(bend_problem(trials, places_of_log(log, believed), believed, motors, search))
    told = told_of_bends(found, knowledge(found))
    assert max(misfit.ratio for misfit in misfits(found)) < search.lack_of_fit
    truth = {"stiffness": WRIST.stiffness, "stiffness_across": WRIST.stiffness, "damping": WRIST.damping, "delay": 0.0,
             "tendon_stiffness": TENDONS.tendon_stiffness, "friction": TENDONS.friction,
             "presliding": TENDONS.presliding}  # fmt: skip
    truth |= {f"gain_{number}": 1.0 for number in (1, 2, 4, 5)}
    truth |= {"direction_1": -135.0, "direction_2": 135.0, "direction_4": -45.0, "direction_5": 45.0}
    for name, value in truth.items():
        known = told[name].known
        assert (known or name == "damping") and told[name].low < value < told[name].high, name


@pytest.mark.parametrize("ratio", [1.3, 0.75])
@pytest.mark.slow
def test_springs_that_differ_between_planes_are_found_where_equal_ones_are_believed(
    tmp_path: Path, ratio: float
) -> None:
    """No tendon of these motions goes slack; a search that lets some go slack ends in a wrong minimum."""
    motion = ("simulate.reference.kind=circumduction", "simulate.controller=pd-ff", f"wrist.flexion_ratio={ratio}")
    log, search = seen(simulated(tmp_path, MOTORS, *SMOOTH, *motion), 0.003, 4), IdentifySettings()
    problem = bend_problem(trials_of_logs([log], WRIST, search.step), places_of_log(log, WRIST), WRIST, TENDONS, search)
    found = fit(problem)
    told = told_of_bends(found, knowledge(found))
    truth = {"stiffness": WRIST.stiffness, "stiffness_across": ratio * WRIST.stiffness, "stiffness_axis_deg": 0.0,
             "damping": WRIST.damping, "delay": 0.0}  # fmt: skip
    for name, value in truth.items():
        known = told[name].known
        assert (known or name == "damping") and told[name].low < value < told[name].high, name
    assert found.noise == pytest.approx(math.radians(0.003), rel=0.03)
    (trial,) = problem.trials
    candidate = problem.candidate(trial, found.x)
    assert courses([candidate], trial.reeled, search.step, search.segments, pulls=True)[0, :, 2:].min() > 0.0


@pytest.mark.parametrize(
    ("tendons", "numbers"),
    [("four", (1, 2, 4, 5)), ("five", (1, 2, 4, 5)), ("three", (1, 2, 3)), ("[{angle_deg: 0, multiplicity: 2}, "
     "{angle_deg: 120}, {angle_deg: 240}]", (1, 2, 3))],
)  # fmt: skip
def test_tendons_keep_the_numbers_that_identification_reads(
    tmp_path: Path, tendons: str, numbers: tuple[int, ...]
) -> None:
    study = wristctl.load_study(None, MOTORS, "simulate.loop.actuator.friction=0", f"wrist.tendons={tendons}")
    places = TendonLayout.of(study.wrist).places
    time = 1e-3 * np.arange(30.0)
    columns = dict.fromkeys(("time", "bend_ulnar", "bend_flexion", "tip_x", "tip_y", "tip_z"), time)
    columns |= {f"spool_{k + 1}": k + time for k in range(len(places))}
    columns |= {f"acting_{k + 1}": 100.0 + k + time for k in range(len(places))}
    columns |= {f"pull_{k + 1}": 200.0 + k + time for k in range(len(places))}
    with start_run("simulate", study, out=tmp_path) as run:
        run.table("data/bends.csv", columns)
    with start_run("compare", study, out=tmp_path) as comparison:
        rows = {name: np.stack([column, column + 1.0]) for name, column in columns.items()}
        comparison.arrays("data/trajectories.npz", {**rows, "time": time})
    log = open_log_of(Run(run.path))
    off_axis = [k for k, place in enumerate(places) if place.radius > 0.0]
    assert tuple(log.tendons("spool")) == tuple(log.tendons("tension")) == numbers
    for (number, spool), k in zip(log.tendons("spool").items(), off_axis, strict=True):
        np.testing.assert_array_equal(spool, k + time)
        tension = log.columns[f"tension_{number}"]
        np.testing.assert_array_equal(tension, (100.0 + k + time) / places[k].multiplicity)
    for later, motion in enumerate([*motions_of(Run(run.path)), *motions_of(Run(comparison.path))]):
        assert motion.commands is not None
        assert list(motion.commands.columns) == [f"tension_{number}" for number in numbers]
        for (_, tension), k in zip(motion.commands.columns.items(), off_axis, strict=True):
            np.testing.assert_array_equal(tension, (200.0 + k + time + (later == 2)) / places[k].multiplicity)
    if max(place.multiplicity for place in places) == 1:
        assert tuple(places_of_log(log, study.wrist)) == numbers
