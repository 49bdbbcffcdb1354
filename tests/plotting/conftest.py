"""Small results with known numbers, and every figure drawn from them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from wristctl.api import load_study
from wristctl.commands.compare.figures import (
    error_against_variation,
    error_over_disturbance,
    rmse_map,
    tension_rows,
    variation_dots,
)
from wristctl.commands.hw_run.figures import DIRECTIONS, Course, LoggedTrial, bends_over_time, lateness
from wristctl.commands.hw_run.figures import errors as trial_errors
from wristctl.commands.hw_run.figures import tensions as trial_tensions
from wristctl.commands.simulate.figures import sliding
from wristctl.commands.track.figures import angle
from wristctl.commands.tune.figures import convergence, gain_history, gain_sensitivity
from wristctl.comparison.combinations import ComparedRow
from wristctl.comparison.controller_ranking import Ranking, class_rankings
from wristctl.config.wrist import WristParameters
from wristctl.control.pid import PID
from wristctl.control.smc import SMC
from wristctl.control.table import CONTROLLERS
from wristctl.plotting.loop_figures import over_time, tensions
from wristctl.plotting.ranking_figures import (
    answer_figure,
    paired_ratios,
    performance_profile,
    probability_of_better,
)
from wristctl.plotting.wrist_drawing import directions, stroboscope
from wristctl.simulation.repetitions import Repeated, Simulation
from wristctl.simulation.trajectory import Trajectory
from wristctl.tuning.search import Search, Tried
from wristctl.vision.marker import Sighting, SightingVerdict
from wristctl.wrist.kinematics import chain_tip

WRIST = WristParameters()


REFERENCES = ("step 30 deg", "minimum jerk 1 s 30 deg", "minimum jerk 2 s 30 deg")
ROWS = ("smc/printed", "smc/exchanged", "smc/tuned", "pid/tuned", "feedforward/default", "computed-torque/default")


def course(label: str, tau: float = 0.3, diverges: bool = False, network_error: float = 0.0) -> Trajectory:
    """A first-order response to a step of 30 deg, on four segments."""
    time, final = np.arange(200.0) * 0.025, np.radians(30.0)
    theta = final * (1.0 - np.exp(-time / tau))
    if diverges:
        theta = np.where(time < 2.0, np.expm1(2.0 * time), np.nan)
    segments = np.repeat(0.25 * theta[:, None], 4, axis=1)
    wanted = np.full_like(time, final)
    tension = np.stack([np.where(np.arange(200) % 2, 60.0, 2.0), np.full(200, 2.0)], axis=-1)
    torque = 0.04 * (tension[:, 0] - tension[:, 1])
    tip, tip_desired = (chain_tip(np.repeat(0.25 * each[:, None], 4, axis=1), WRIST.length) for each in (theta, wanted))
    rate = np.gradient(theta, time)
    reference = wanted + network_error
    return Trajectory(
        label, time, theta, segments, rate, reference, wanted, tip, tip_desired, 2.0 * torque, torque, tension
    )


def late() -> Trajectory:
    """The same behind a camera and slow motors."""
    one = course("smc/exchanged")
    return replace(one, seen=np.roll(one.theta, 3), acting=0.5 * one.tension)


def result(row: str, reference: str, rmse: float, failed: bool = False) -> ComparedRow:
    controller, gains = row.split("/")
    metrics = {"rmse": np.nan if failed else rmse, "chattering": 1e6 * rmse}
    done = Simulation(course(row, 1.0, failed), metrics, failed, 0.5)
    return ComparedRow("four-segments", reference, "closed-form", controller, gains, Repeated.once(done))


def results() -> list[ComparedRow]:
    """RMSE 1e-5, 2e-5, ... in the order of rows and references; smc/exchanged diverged on the step."""
    pairs = [(row, reference) for row in ROWS for reference in REFERENCES]
    return [result(*pair, rmse=1e-5 * (k + 1), failed=k == 3) for k, pair in enumerate(pairs)]


def rankings() -> list[Ranking]:
    """Of the same rows: what diverged must not be used."""
    study = load_study(None, "compare.loops={four-segments: {}}")
    return class_rankings([each for each in results() if each.controller != "nc"], study.compare, study.wrist)


def many_rankings() -> list[Ranking]:
    """Every controller of the table in one condition, the first the best."""
    study = load_study(None, "compare.loops={four-segments: {}}")
    rows = [
        result(f"{name}/default", move, 1e-5 * (k + 1)) for k, name in enumerate(CONTROLLERS) for move in REFERENCES
    ]
    return class_rankings(rows, study.compare, study.wrist)


PLACES = {"sampled": "sampled", "sampled, steps": "sampled (steps)"}


def pushed() -> list[ComparedRow]:
    """Two rows on three loops, the larger the worse; the first fails on the last."""
    return [
        replace(result(row, REFERENCES[0], 1e-4 * (at + 1) * (k + 1), failed=k == 0 and at == 2), loop=loop)
        for k, row in enumerate(("smc/printed", "pid/tuned"))
        for at, loop in enumerate("abc")
    ]


def search(name: str = "smc", count: int = 3) -> Search:
    """Twelve iterations of eight candidates that close in on gains of 10."""
    rng = np.random.default_rng(len(name))
    exponent = 1.0 + rng.normal(size=(12, 8, count)) / np.arange(1, 13)[:, None, None]
    values = 0.02 + (np.abs(exponent - 1.0).sum(axis=-1)) ** 2
    values[0, :3] = np.inf
    best = np.unravel_index(values.argmin(), values.shape)
    gains = dict(zip("abc", 10.0 ** exponent[best], strict=False))
    return Search(name, gains, float(values.min()), values.size, Tried(values, 10.0**exponent), 1)


def trials() -> list[LoggedTrial]:
    """Two repetitions in three directions, with a simulation, one of them pushed."""
    one = course("smc/exchanged")
    bend, ref, wanted = (angle[:, None] for angle in (one.theta, one.theta_ref, one.theta_desired))
    simulated = Course(one.time, 0.9 * bend, 0.1 * bend)
    pulls = {"tendons that pull": one.tension[:, 0], "tendons that hold against": one.tension[:, 1]}
    pushes = {"flexion": (2.0, 2.5)}
    return [
        LoggedTrial(
            each, one.label, k, ("flexion",), one.time, bend, ref, wanted, pulls, simulated, push=pushes.get(each)
        )
        for each in DIRECTIONS[:3]
        for k in range(2)
    ]


def sightings() -> list[Sighting]:
    """A marker that swings, hidden now and then and blurred once."""
    kinds = {7: SightingVerdict.NO_BASE, 8: SightingVerdict.NO_BASE, 20: SightingVerdict.NO_TIP}
    found = [(kinds.get(k, SightingVerdict.OK), 0.02 * k) for k in range(50)]
    corners = np.zeros((2, 4, 2))
    return [
        Sighting(time, k, np.sin(time) if verdict is SightingVerdict.OK else np.nan, verdict, corners)
        for k, (verdict, time) in enumerate(found)
    ]


assert SMC.surface is not None
SURFACE = SMC.surface
PUSHES = ("disturbances.push.force", {"a": 0.0, "b": 1.0, "c": 2.0})

FIGURES: dict[str, Callable[[], Figure]] = {
    "angles": lambda: over_time(
        [course(row, 0.1 * k + 0.1, k == 1) for k, row in enumerate(ROWS)], "angle", heading="Loop default"
    ),
    "errors": lambda: over_time([course("smc/printed"), course("smc/tuned", 0.1)], "error", heading="SMC"),
    "errors, log": lambda: over_time([course("pid/printed"), course("pid/tuned", 0.1)], "size"),
    "tensions": lambda: tensions(course("smc/exchanged")),
    "angles, late": lambda: over_time([late()], "angle"),
    "tensions, late": lambda: tensions(late()),
    "rmse map": lambda: rmse_map(results(), "Loop default"),
    "answer": lambda: answer_figure(rankings(), PLACES),
    "answer, many": lambda: answer_figure(many_rankings(), PLACES),
    "ratios, many": lambda: paired_ratios(many_rankings(), "feedforward/default", PLACES),
    "who beats whom, many": lambda: probability_of_better(many_rankings()[0], "sampled"),
    "performance profile": lambda: performance_profile(rankings(), PLACES),
    "ratios to feedforward": lambda: paired_ratios(rankings(), "feedforward/default", PLACES),
    "who beats whom": lambda: probability_of_better(rankings()[0], "sampled"),
    "overlay": lambda: over_time(
        [course(row, 0.1 * k + 0.1, k == 1) for k, row in enumerate(ROWS)], "angle", "measurable size", heading="ideal"
    ),
    "error against variation": lambda: error_against_variation(results(), rankings()),
    "tensions of several": lambda: tension_rows([course(row, 0.1 * k + 0.1) for k, row in enumerate(ROWS[:3])], "all"),
    "error over a disturbance": lambda: error_over_disturbance(
        pushed(), "disturbances.push.force", {"a": 0.0, "b": 1.0, "c": 2.0}
    ),
    "variation": lambda: variation_dots(results(), "Loop default"),
    "sliding": lambda: sliding(course("smc/hardware"), SURFACE, SMC.presets["hardware"]),
    "sensitivity of gains": lambda: gain_sensitivity("pid", ["Kp", "Ki"], 1.5, np.array([1.0, 1.5, 0.9, 1.2, 1.1])),
    "convergence": lambda: convergence([search("smc"), search("pid"), search("computed-torque")]),
    "gain history of smc": lambda: gain_history(search("smc"), SMC.gains),
    "gain history of pid": lambda: gain_history(search("pid"), PID.gains),
    "trials, angles": lambda: bends_over_time(trials(), "Trials"),
    "trials, errors": lambda: trial_errors(trials(), "Trials"),
    "trials, tensions": lambda: trial_tensions(trials(), "Trials"),
    "lateness": lambda: lateness(np.random.default_rng(0).exponential(2e-4, 2000), 5e-3),
    "tracked angle": lambda: angle(sightings()),
    "directions": lambda: directions(WRIST),
    "stroboscope": lambda: stroboscope(course("smc/tuned"), WRIST),
}
"""Every figure of the report but those of learning, of a camera's calibration and of an identification."""


@pytest.fixture(params=FIGURES, scope="module")
def make(request: pytest.FixtureRequest) -> Callable[[], Figure]:
    """Each figure in turn, or the ones named by indirect parameters."""
    return FIGURES[request.param]


@pytest.fixture(scope="module")
def drawn(make: Callable[[], Figure]) -> Figure:
    """Each figure, laid out as on paper."""
    made = make()
    made.draw_without_rendering()
    return made


@pytest.fixture(name="course")
def course_maker() -> Callable[..., Trajectory]:
    return course


@pytest.fixture(name="results", scope="session")
def results_of_a_comparison() -> list[ComparedRow]:
    return results()


@pytest.fixture(name="search")
def search_of_smc() -> Search:
    return search()
