"""Wrists with friction inside and slack tendons, drawn at random, simulated and identified from a recording each.

What is counted: how many 95 % intervals hold the truth, and how often each of the two is found where it is and where it
is not. `python -m tests.identification.inner_rigs --count 100` keeps what has ended, and goes on where it was.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tests.drawn_rigs import options, tried
from wristctl.arrays import Array
from wristctl.config.identify import IdentifySettings
from wristctl.config.plant import Actuator, TrueWrist
from wristctl.config.wrist import WristParameters
from wristctl.identification.arc_fit import fit_arcs
from wristctl.identification.friction_fit import fit_in_turn
from wristctl.identification.log_model import everything_fitted, recordings_of_logs, robot_of_logs
from wristctl.identification.loop_problem import LoopProblem
from wristctl.identification.measured_loop import MeasuredLoop
from wristctl.identification.model_choice import chosen_of, tried_models
from wristctl.records.open_log import OpenLog
from wristctl.simulation.spool_driven import SpooledWrist, spooled

SEED = 20261126
BELIEVED = WristParameters(gravity=(0.0, 0.0), gravity_flexion=0.0, hand_mass=0.0)
TENDONS = Actuator(level="tendon", friction=0.0)
# Largest torque of inner friction [N m] and slack [m] of a rig, of which it has a half to all.
MOST_TORQUE, MOST_SLACK = 0.06, 2e-3
# Integration step [s] and segments of the simulated wrist, and noise of its angle [rad].
_STEP, _SEGMENTS, _NOISE = 5e-4, 4, math.radians(0.05)


class InnerRig(NamedTuple):
    """A wrist that nobody knows."""

    wrist: WristParameters
    tendons: Actuator
    plant: TrueWrist
    slack: tuple[float, float]
    """Of the + and the - side [m]."""


class Counted(NamedTuple):
    """What one recording told: intervals by name, by (low, truth, high), and what was found."""

    intervals: dict[str, tuple[float, float, float]]
    inner: bool
    slack: bool
    misfit: float


def drawn_rig(rng: np.random.Generator, present: bool) -> InnerRig:
    """Springs 30 % weaker to 10 % stiffer, damping and tendons within 20 %, the radius within 1 %."""
    wrist = BELIEVED.model_copy(
        update={
            "stiffness": BELIEVED.stiffness * rng.uniform(0.7, 1.1),
            "damping": BELIEVED.damping * math.exp(0.1 * rng.standard_normal()),
            "tendon_radius": BELIEVED.tendon_radius * (1.0 + 0.01 * rng.standard_normal()),
        }
    )
    stiffness = TENDONS.tendon_stiffness * math.exp(0.1 * rng.standard_normal())
    torque, slack = MOST_TORQUE * rng.uniform(0.5, 1.0), MOST_SLACK * rng.uniform(0.5, 1.0, 2)
    plant = TrueWrist(inner_friction=torque * present, inner_presliding_deg=rng.uniform(0.3, 1.0))
    plus, minus = slack * present
    return InnerRig(wrist, TENDONS.model_copy(update={"tendon_stiffness": stiffness}), plant, (plus, minus))


def recorded(
    rig: InnerRig, path: Callable[[Array], Array], time: Array, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Angle (T,) [rad] as a camera has it, and what both spools count (T, 2) [m], of a + side that reels in a path."""

    def reeled(at: Array, which: Any) -> Array:
        return np.stack([path(at) - rig.slack[0], -path(at) - rig.slack[1]], axis=1)[:, :, None]

    lane = SpooledWrist(rig.wrist, rig.tendons, np.zeros(_SEGMENTS), plant=rig.plant)
    done = spooled([lane], reeled, math.ceil(time[-1] / _STEP) + 2, _STEP)
    angle = np.interp(time, _STEP * np.arange(done.theta.shape[1]), done.theta[0])
    return angle + _NOISE * rng.standard_normal(len(time)), np.stack([path(time), -path(time)], axis=1)


def by_arcs(rig: InnerRig, rng: np.random.Generator) -> Counted:
    """What `identify my.csv` finds of 16 s of strokes of several lengths."""
    time = 0.04 * np.arange(400.0)
    angle, spools = recorded(rig, lambda at: 6e-3 * np.sin(1.6 * at) * (0.7 + 0.3 * np.sin(0.37 * at)), time, rng)
    log = OpenLog(Path("made.csv"), "log",
                  {"time": time, "bend_y": angle, "spool_1": spools[:, 0], "spool_2": spools[:, 1]})  # fmt: skip
    robot = robot_of_logs([log], BELIEVED, 0.01)
    recordings = recordings_of_logs([log], robot)
    models = list(tried_models(robot, [recordings], False))
    chosen, verdicts = chosen_of(models), {model.terms[-1]: model.verdict for model in models if model.terms}
    fit = fit_arcs(robot, chosen.terms, everything_fitted(recordings), begin=chosen.fits[0].values)
    stiffness, radius = rig.wrist.stiffness, rig.wrist.tendon_offset
    truth = {
        "gain": BELIEVED.tendon_offset / radius, "tendon": 2.0 * rig.tendons.tendon_stiffness * radius**2 / stiffness,
        "delay": 0.0, "damping": rig.wrist.damping / stiffness, "inner_friction": rig.plant.inner_friction / stiffness,
        "inner_presliding": math.radians(rig.plant.inner_presliding_deg),
    }  # fmt: skip
    intervals = {name: (told.low, truth[name], told.high) for name, told in fit.told.items() if name in truth}
    return Counted(intervals, "inner friction" in chosen.terms, verdicts["slack"] == "wanted", fit.rms() / _NOISE)


def by_loop(rig: InnerRig, rng: np.random.Generator) -> Counted:
    """What `identify --model hysteresis` finds of two cycles without tensions."""
    time = 0.02 * np.arange(400.0)
    angle, spools = recorded(rig, lambda at: 6e-3 * np.sin(0.5 * math.pi * at), time, rng)
    settings = IdentifySettings(segments=1, step=1e-3)
    fit = fit_in_turn(LoopProblem(MeasuredLoop("made.csv", time, angle, spools, None), BELIEVED, settings))[-1]
    found = {"stiffness": fit.stiffness, "tendon_radius": fit.tendon_radius, "slack_plus": fit.slack[0],
             "slack_minus": fit.slack[1], "exponent": fit.exponent}  # fmt: skip
    truth = {"stiffness": rig.wrist.stiffness, "tendon_radius": rig.wrist.tendon_radius, "slack_plus": rig.slack[0],
             "slack_minus": rig.slack[1], "exponent": 0.0}  # fmt: skip
    if not fit.problem.supposed.freed:
        del found["tendon_radius"], found["stiffness"]  # as believed, to 10 %, which these wrists are not
    if fit.inner_friction is not None and fit.inner_presliding is not None:
        found |= {"inner_friction": fit.inner_friction, "inner_presliding": fit.inner_presliding}
        truth |= {"inner_friction": rig.plant.inner_friction}
        truth |= {"inner_presliding": math.radians(rig.plant.inner_presliding_deg)}
    intervals = {name: (one.low, truth[name], one.high) for name, one in found.items()}
    slack = max(side.low for side in fit.slack) > 3e-4
    return Counted(intervals, fit.inner_friction is not None, slack, fit.misfit)


WAYS = {"arcs": by_arcs, "loop": by_loop}


def counted(way: str, number: int, present: bool) -> Counted:
    """What a rig's recording tells."""
    rng = np.random.default_rng([SEED, number, int(present)])
    return WAYS[way](drawn_rig(rng, present), rng)


def summary(results: list[Counted], present: bool) -> list[str]:
    """Lines: how often each is found rightly, and how many intervals hold the truth of those that are told."""
    lines = [f"{len(results)} rigs {'with' if present else 'without'}: inner friction found in "
             f"{sum(one.inner for one in results)}, slack in {sum(one.slack for one in results)}"]  # fmt: skip
    held, told = Counter[str](), Counter[str]()
    for one in results:
        for name, (low, truth, high) in one.intervals.items():
            told[name] += math.isfinite(low + high)
            held[name] += low <= truth <= high
    return lines + [f"  {name}: told in {told[name]}, holds the truth in {held[name]}" for name in held]


def main() -> None:
    """Identify rigs, and say how many intervals hold."""
    parser = options(__doc__, 100, "inner-rigs")
    parser.add_argument("--way", choices=WAYS, default="arcs")
    asked = parser.parse_args()
    for present, folder in ((True, "with"), (False, "without")):
        rigs = tried(asked, lambda number: counted(asked.way, number, present)._asdict(), f"{asked.way}/{folder}")  # noqa: B023
        print("\n".join(summary([Counted(**rig) for _, rig in rigs], present)), flush=True)


if __name__ == "__main__":
    main()
