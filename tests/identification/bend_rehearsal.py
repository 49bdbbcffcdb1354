"""Rehearsals in two planes: the open log that a bench would write of a wrist whose parameters are given.

Its spools move along a plan that a bench could follow: from bend to bend, all around, with tendons that are pulled
tighter at some of them, as a controller that believes in a wrist would place its spools, and no faster than motors go.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from wristctl.arrays import Array
from wristctl.config.plant import Actuator
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.identification.forward import Places, Supposed, courses
from wristctl.records.open_log import OpenLog
from wristctl.simulation.references import minimum_jerk
from wristctl.wrist.allocation import allocated
from wristctl.wrist.spatial.spatial_model import spatial_terms
from wristctl.wrist.spatial.spatial_segments import ellipse, own_values
from wristctl.wrist.tendon_layout import TendonLayout

# Tick of the simulation [s], and how many of them lie between two rows of spools.
_PERIOD, _LOGGED = 1e-3, 5
# Instants of an exposure.
_INSTANTS = 41
# Largest acceleration of a minimum-jerk move over distance and squared duration, and share of the motors' own.
_JERK, _CAREFUL = 5.7735, 0.8


@dataclass(frozen=True)
class Hold:
    """A bend that is held: its size and direction [deg], and the least pull of a tendon over the pretension.

    At 0 the tendons that do not pull are slack, so that springs and weight alone hold the wrist across the others.
    """

    size_deg: float
    toward_deg: float
    tightness: float = 1.0


PLAN = tuple(
    Hold(size, toward, tight)
    for size, toward, tight in (
        (25, 45, 0), (25, 90, 0), (15, 225, 4), (25, 135, 0), (12, 290, 1), (25, 225, 0), (28, 65, 4), (25, 315, 0),
        (25, 0, 0), (0, 0, 4), (25, 180, 0), (22, 335, 1), (28, 270, 0), (18, 110, 4), (25, 20, 0), (0, 0, 1),
    )
)  # fmt: skip
"""Holds all around, with tendons slack, taut and tight."""
# Length that a spool lets go beyond where its tendon is without tension, where it is to be slack [m].
_LOOSE = 1.5e-3
# Pull above the least one up to which a tendon is said not to pull [N].
_IDLE = 0.5


@dataclass(frozen=True)
class RehearsedBends:
    """True parameters of a rehearsed bench, unknown to its user."""

    wrist: WristParameters
    actuator: Actuator
    layout: TendonLayout
    """Places of the tendons as they are."""
    taut: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    """Length that each tendon has reeled in beyond its spool's count [m]."""
    delay: float = 0.03
    noise_deg: float = 0.05
    zero_deg: tuple[float, float] = (0.0, 0.0)
    turn_deg: tuple[float, float] = (0.0, 0.0)
    """Turn of the view of each plane about the wrist's axis, from ulnar toward flexion."""
    too_much: tuple[float, float] = (0.0, 0.0)
    """Share of its bend that the view of each plane shows too much."""
    frame_rate: float = 60.0
    exposure: float = 4e-3
    dropped: float = 0.05
    tension_noise: float | None = None
    """Standard deviation of measured tensions [N]; None: none is measured."""
    segments: int = 4


def planned_spools(
    wrist: WristParameters, actuator: Actuator, layout: TendonLayout, plan: Sequence[Hold] = PLAN, hold: float = 0.6
) -> Array:
    """Microsteps that each spool has reeled in (T, M) every millisecond, as a controller plans them.

    Parameters
    ----------
    wrist, actuator, layout : as believed
    plan : bends that are held, one after the other, from the straight wrist
    hold : time from the begin of a move to the next one's [s]

    Raises UserError where motors need longer than that for a move.
    """
    angles = np.radians([step.toward_deg for step in plan])
    bends = np.radians([step.size_deg for step in plan])[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    ends = np.concatenate([[[0.0, 0.0, 1.0]], np.column_stack([bends, [step.tightness for step in plan]])])
    reeled = _reeled(wrist, actuator, layout, ends)
    acceleration = _CAREFUL * actuator.step_acceleration * actuator.step_length
    time = _PERIOD * np.arange(round(hold / _PERIOD))
    parts = []
    for before, after in itertools.pairwise(reeled):
        duration = max(0.1, math.sqrt(_JERK * float(np.abs(after - before).max()) / acceleration))
        if duration > hold:
            raise UserError(f"a move takes the motors {duration:.2g} s", "hold", f"more than {hold:g} s")
        parts.append(before + minimum_jerk(time.astype(float), duration)[0][:, None] * (after - before))
    counts: Array = np.rint(np.concatenate(parts) / actuator.step_length)
    return counts


def _reeled(wrist: WristParameters, actuator: Actuator, layout: TendonLayout, aims: Array) -> Array:
    """Lengths on the spools (T, M) [m] that hold bends with least pulls, aims (T, 3), by one arc. Raises UserError."""
    bends, tightness = aims[:, :2], aims[:, 2:]
    axis = math.radians(wrist.stiffness_axis_deg)
    values = own_values(wrist, 1, layout)
    at_rest = spatial_terms(values, bends, 0.0 * bends)
    yy, yz, zz = ellipse(wrist.stiffness, wrist.stiffness * wrist.flexion_ratio, axis)
    torque = at_rest.bias + bends @ np.array([[yy, yz], [yz, zz]])
    arms = at_rest.moment_arms.reshape(len(aims), -1, 2)
    more = (tightness - 1.0) * wrist.pretension
    tighter = torque - (more[:, :, None] * arms).sum(axis=1)
    found = allocated(arms, tighter, wrist.pretension, wrist.tension_limit)
    if found.saturated.any() or (found.pulls + more).max() > wrist.tension_limit:
        raise UserError("a bend out of the tendons' reach", "plan", "smaller or looser ones")
    idle = found.pulls <= wrist.pretension + _IDLE
    loose = _LOOSE * np.where(idle, (1.0 - tightness).clip(0.0), 0.0)
    reeled: Array = (found.pulls + more) / actuator.tendon_stiffness + wrist.length - at_rest.lengths - loose
    return reeled


def rehearse_bends(
    truth: RehearsedBends, counts: Array, step_length: float, rng: np.random.Generator, trial: str = "",
    name: str = "rehearsed",
) -> OpenLog:  # fmt: skip
    """The open log of a bench whose spools are moved by so many microsteps.

    Parameters
    ----------
    truth : the bench as it is
    counts : microsteps that each spool has reeled in (T, M), every millisecond
    step_length : what a microstep reels in by the bench's own knowledge [m]
    rng : of noise and of frames that are dropped
    trial, name : of the log
    """
    layout, tendons = truth.layout, counts.shape[1]
    numbers = (1, 2, 4, 5) if tendons == 4 else tuple(range(1, tendons + 1))
    supposed = Supposed(truth.wrist, truth.actuator, truth.taut, Places.of(layout, truth.wrist.discs))
    reeled = truth.actuator.step_length * counts
    course = courses([supposed], reeled, _PERIOD, truth.segments, pulls=True)[0]
    time = _PERIOD * np.arange(len(course))
    ticks = slice(None, None, _LOGGED)
    captured = np.arange(rng.uniform(0.0, 1.0), time[-1] * truth.frame_rate) / truth.frame_rate
    captured = captured[rng.random(len(captured)) >= truth.dropped]
    shutter = captured - truth.delay + truth.exposure * np.linspace(-0.5, 0.5, _INSTANTS)[:, None]
    clock = np.concatenate([time[ticks] + 0.5 * _PERIOD, captured])
    count, order = len(time[ticks]), np.argsort(clock, kind="stable")
    columns = {"time": clock[order], "mass": np.full(len(clock), truth.wrist.hand_mass)}

    def placed(values: Array, first: int) -> Array:
        whole = np.full(len(clock), math.nan)
        whole[first : first + len(values)] = values
        return whole[order]

    for k, number in enumerate(numbers):
        columns[f"spool_{number}"] = placed(step_length * counts[ticks, k], 0)
        if truth.tension_noise is not None:
            noise = truth.tension_noise * rng.standard_normal(count)
            columns[f"tension_{number}"] = placed(course[ticks, 2 + k] + noise, 0)
    for plane, bend in enumerate(("bend_y", "bend_z")):
        turned = math.radians((1, -1)[plane] * truth.turn_deg[plane]) * course[:, 1 - plane]
        shown = (1.0 + truth.too_much[plane]) * course[:, plane] + turned
        seen = np.interp(shutter, time, shown).mean(axis=0)
        noise = truth.noise_deg * rng.standard_normal(len(captured)) + truth.zero_deg[plane]
        columns[bend] = placed(seen + np.radians(noise), count)
    words = {"trial": np.full(len(clock), trial)} if trial else {}
    return OpenLog(Path(f"{name}.csv"), "log", columns, words)
