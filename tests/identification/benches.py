"""Rehearsed benches: wrists with errors of their own, and what is logged of them."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np

from wristctl.config.identify import IdentifySettings
from wristctl.config.loop import DirectionName, Reference
from wristctl.config.plant import Actuator
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.identification import rehearsal
from wristctl.identification.fit import Problem
from wristctl.identification.measured_trials import MeasuredTrial, measured_trials
from wristctl.identification.rehearsal import RehearsedTruth, rehearse
from wristctl.records import Run, start_run

KNOWN, TENDONS = WristParameters(), Actuator(level="tendon")
UPRIGHT = KNOWN
LEVEL = KNOWN.model_copy(update={"gravity": (0.0, 6.94), "gravity_flexion": 6.94})
STEPS = Reference(kind="multi-step", angles_deg=(25.0, -10.0, 30.0, 0.0, 20.0, -15.0, 30.0, 0.0), duration=0.6)
SLOW = Reference()
DIRECTIONS: tuple[DirectionName, ...] = ("ulnar", "radial", "flexion", "extension")
START = {"tendon_stiffness": 20e3, "friction": 0.1, "delay": 0.0} | {
    name: getattr(KNOWN, name) for name in ("stiffness", "damping", "tendon_radius")
}

rehearsal.spools = cache(rehearsal.spools)  # the same moves of the same motors, whatever hangs on them


def bench(seed: int, **truth: float) -> tuple[Callable[[WristParameters], RehearsedTruth], dict[str, float]]:
    """A bench whose wrist has 30 % softer springs, with small errors of its own drawn from the seed: truth by pose."""
    rng = np.random.default_rng(seed)
    radius = KNOWN.tendon_radius * (1.0 + 0.01 * rng.standard_normal())
    clock = IdentifySettings().clock_error * rng.standard_normal()
    values = {
        "stiffness": 0.7 * KNOWN.stiffness, "damping": KNOWN.damping, "tendon_stiffness": 20e3, "friction": 0.1,
        "delay": 0.03, "tendon_radius": radius,
    } | truth  # fmt: skip

    def made(pose: WristParameters) -> RehearsedTruth:
        own = {name: values[name] for name in ("stiffness", "damping", "tendon_radius")}
        tendons = {name: values[name] for name in ("tendon_stiffness", "friction")}
        zero, taut = 0.1 * rng.standard_normal(2), 2e-5 * rng.standard_normal(4)
        return RehearsedTruth(
            pose.model_copy(update=own), TENDONS.model_copy(update=tendons), values["delay"] + clock,
            zero_deg=tuple(zero), taut=tuple(taut),
        )  # fmt: skip

    return made, values


def logged(
    seed: int,
    moves: Reference = STEPS,
    poses: tuple[WristParameters, ...] = (UPRIGHT, LEVEL),
    directions: tuple[DirectionName, ...] = DIRECTIONS,
    **truth: float,
) -> tuple[list[MeasuredTrial], dict[str, float]]:
    """Trials of a rehearsed bench, one run a pose, and the true parameters."""
    made, values = bench(seed, **truth)
    rng, trials = np.random.default_rng([seed, 1]), []
    for number, pose in enumerate(poses):
        tables = rehearse(pose, made(pose), [(each, moves) for each in directions], 5.0, rng)
        trials += measured_trials(
            f"run {number}", pose, TENDONS.step_length, 1e-3, *tables, exposure=RehearsedTruth.exposure
        )
    return trials, values


def problem(trials: list[MeasuredTrial], **settings: object) -> Problem:
    """The search for all parameters, begun at what the controller believes."""
    return Problem(trials, START, IdentifySettings.model_validate(settings))


def write_run(
    out: Path, seed: int, pose: WristParameters, moves: Reference = STEPS, sides: tuple[DirectionName, ...] = DIRECTIONS
) -> Run:
    """A run of kind hw-run with the trials of a rehearsed bench."""
    made, _ = bench(seed)
    rng = np.random.default_rng([seed, int(abs(pose.gravity_flexion))])
    tables = rehearse(pose, made(pose), [(each, moves) for each in sides], 5.0, rng)
    with start_run("hw-run", Study(wrist=pose), out=out) as run:
        for name, table in zip(("log", "frames", "trials"), tables, strict=True):
            run.table(f"data/{name}.csv", table)
    return Run(run.path)
