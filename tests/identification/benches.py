"""Rehearsed benches: wrists with errors of their own, and what is logged of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from tests.identification import rehearsal
from tests.identification.rehearsal import RehearsedTruth, rehearse
from wristctl.config.identify import IdentifySettings
from wristctl.config.loop import DirectionName, Reference
from wristctl.config.plant import Actuator
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.identification.measured_trials import MeasuredTrial, measured_trials
from wristctl.identification.problem import Problem
from wristctl.identification.unknowns import believed_of, tendons_of_values
from wristctl.records import Run, start_run

KNOWN, TENDONS = WristParameters(), Actuator(level="tendon")
UPRIGHT = KNOWN
LEVEL = KNOWN.model_copy(update={"gravity": (0.0, 6.94), "gravity_flexion": 6.94})
STEPS = Reference(kind="multi-step", angles_deg=(25.0, -10.0, 30.0, 0.0, 20.0, -15.0, 30.0, 0.0), duration=0.6)
SLOW = Reference()
DIRECTIONS: tuple[DirectionName, ...] = ("ulnar", "radial", "flexion", "extension")
START = believed_of(KNOWN, TENDONS)

rehearsal.spools = cache(rehearsal.spools)  # the same moves of the same motors, whatever hangs on them


def tendons(stiffness: float, friction: float) -> Actuator:
    """Tendons with this stiffness [N/m] and coefficient of friction."""
    return TENDONS.model_copy(update={"tendon_stiffness": stiffness, "friction": friction})


def bench(
    seed: int, more: Mapping[str, Any] | None = None, **truth: float
) -> tuple[Callable[[WristParameters], RehearsedTruth], dict[str, float]]:
    """A bench whose wrist has 30 % softer springs, with small errors of its own drawn from the seed: truth by pose.

    `truth` by the names of parameters, `more` leaves of RehearsedTruth that no parameter says.
    """
    rng = np.random.default_rng(seed)
    radius = KNOWN.tendon_radius * (1.0 + 0.01 * rng.standard_normal())
    clock = IdentifySettings().clock_error * rng.standard_normal()
    own = {"stiffness": 0.7 * KNOWN.stiffness, "delay": 0.03, "tendon_radius": radius}
    values = START | own | truth

    def made(pose: WristParameters) -> RehearsedTruth:
        own = {name: values[name] for name in ("stiffness", "flexion_ratio", "damping", "tendon_radius")}
        tendons = TENDONS.model_copy(update=tendons_of_values(values))
        zero, taut = 0.1 * rng.standard_normal(2), 2e-5 * rng.standard_normal(4)
        return RehearsedTruth(
            pose.model_copy(update=own), tendons, values["delay"] + clock, zero_deg=tuple(zero), taut=tuple(taut),
            **(more or {}),
        )  # fmt: skip

    return made, values


def logged(
    seed: int,
    moves: Reference = STEPS,
    poses: tuple[WristParameters, ...] = (UPRIGHT, LEVEL),
    directions: tuple[DirectionName, ...] = DIRECTIONS,
    more: Mapping[str, Any] | None = None,
    **truth: float,
) -> tuple[list[MeasuredTrial], dict[str, float]]:
    """Trials of a rehearsed bench, one run a pose, and the true parameters."""
    made, values = bench(seed, more, **truth)
    rng, trials = np.random.default_rng([seed, 1]), []
    for number, pose in enumerate(poses):
        tables = rehearse(pose, TENDONS, made(pose), [(each, moves) for each in directions], 5.0, rng)
        trials += measured_trials(f"run {number}", pose, TENDONS, 1e-3, *tables, exposure=RehearsedTruth.exposure)
    return trials, values


def problem(trials: list[MeasuredTrial], **settings: object) -> Problem:
    """The search for all parameters, begun at what the controller believes."""
    return Problem(trials, START, IdentifySettings.model_validate(settings), TENDONS)


def write_run(
    out: Path, seed: int, pose: WristParameters, moves: Reference = STEPS, sides: tuple[DirectionName, ...] = DIRECTIONS
) -> Run:
    """A run of kind hw-run with the trials of a rehearsed bench, whose rotors stand where their drives count."""
    made, _ = bench(seed)
    rng = np.random.default_rng([seed, int(abs(pose.gravity_flexion))])
    tables = rehearse(pose, TENDONS, made(pose), [(each, moves) for each in sides], 5.0, rng)
    stiff_fields = {"bench": {"motors": {"rotor_inertia": 0.0}}}
    study = Study.model_validate({"wrist": pose.model_dump(), "hw_run": stiff_fields})
    with start_run("hw-run", study, out=out) as run:
        for name, table in zip(("log", "frames", "trials"), tables, strict=True):
            run.table(f"data/{name}.csv", table)
    return Run(run.path)
