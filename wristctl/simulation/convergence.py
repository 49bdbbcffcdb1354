"""Whether a rollout's integration step is short enough, and how short it has to be where it is not.

RODAS3 carries an embedded solution of second order: the sum of the differences over all steps, without their share in
modes that die out within a step, is above the error of the angle where forces change smoothly, so that a rollout is in
doubt where that sum is large. It misses a part of what happens between: a torque that jumps from limit to limit at
every tick, and the kinks of friction, backlash and end stops. So it counts several times where tensions keep swinging.

A rollout in doubt runs again with 2, 4, 8, ... times as many steps, until its numbers stay what they are.
"""

from collections.abc import Callable
from threading import Event

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.loop import MOST_SUBSTEPS, Loop
from wristctl.simulation.oscillation import FASTEST
from wristctl.simulation.outcome import Outcome

# Factors on the integration steps, tried in this order.
FINER = (2, 4, 8, 16, 32, 64)
# Share of itself, or angle [rad], within which an RMSE is right.
RELATIVE, ABSOLUTE = 0.01, float(np.deg2rad(0.002))
# Share of that by which it may still change when the step is halved.
HALF = 0.5
# Factor on that for the mean error at the end: of a wrist that swings there the horizon cuts off a part.
AT_THE_END = 10.0
# Sum of the steps' estimated errors, over the tolerance of the RMSE, from which a rollout is in doubt; and how many
# times as much where forces have kinks, which the estimate takes for errors.
DOUBT, KINKS = 4.0, 8.0
# Frequency of tensions from nothing to their largest and back, from which a loop with kinks swings [1/s]; loops without
# do where they chatter (FASTEST).
SWINGS = 0.8
# Factor by which the estimated errors of loops that swing count: they miss a part of what the step does to these; and
# of loops with kinks whose tensions go so often through all that the wrist's tendons bear: such a swing is chaotic.
SWINGING, CHAOTIC = 8.0, 40.0

Rollouts = NDArray[np.int64]
Mask = NDArray[np.bool_]


def tolerance(angles: Array) -> Array:
    """Permitted error [rad] of angles [rad]: 1 % of themselves, or 0.002 deg."""
    sizes: Array = np.fmax(RELATIVE * np.abs(angles), ABSOLUTE)
    return sizes


def _swinging(outcome: Outcome, kinked: Mask) -> Mask:
    """Rollouts whose tensions swing so often that the steps' estimated errors miss what matters, (count,)."""
    with np.errstate(invalid="ignore", divide="ignore"):
        swings = outcome.metrics["chattering"] / (float(outcome.places) * outcome.metrics["peak_tension"])
    often: Mask = swings > np.where(kinked, SWINGS, FASTEST)
    return often


def _most(outcome: Outcome, kinked: Mask) -> Array:
    """Sum of the steps' estimated errors beyond which each is in doubt, (count,) [rad]."""
    most: Array = DOUBT * np.where(kinked, KINKS, 1.0) * tolerance(outcome.metrics["rmse"])
    return most


def _excess(outcome: Outcome, kinked: Mask, bears: Array) -> Array:
    """Sum of the steps' estimated errors, as counted, divided by its limit (count,): above 1 the step is in doubt."""
    slams = outcome.metrics["chattering"] / (2.0 * outcome.places * bears) > SWINGS
    factor = np.where(kinked & slams, CHAOTIC, np.where(_swinging(outcome, kinked), SWINGING, 1.0))
    excess: Array = factor * outcome.step_error / _most(outcome, kinked)
    return excess


def in_doubt(outcome: Outcome, kinked: Mask, bears: Array) -> Mask:
    """Rollouts whose integration step may be too long, (count,).

    `kinked` are those with friction or end stops, `bears` is the range of tension of each wrist's tendons [N].
    """
    return _doubtful(_excess(outcome, kinked, bears))


def _doubtful(excess: Array) -> Mask:
    """Where there is too much, or nobody knows how much, (count,)."""
    doubtful: Mask = ~(excess <= 1.0)
    return doubtful


def in_one_go(outcome: Outcome, kinked: Mask, bears: Array) -> tuple[Mask, Rollouts]:
    """Judge rollouts that cannot run again: which are in doubt, (count,), and steps in a period that are likely to do.

    The steps are twice as many times as the sum of errors is too large, and more where tensions swing, since that falls
    more slowly than the step where the torque jumps; a power of two, as those that are tried.
    """
    swinging = np.where(_swinging(outcome, kinked), 0.25 * SWINGING, 1.0)
    excess = _excess(outcome, kinked, bears)
    times = np.clip(np.nan_to_num(2.0 * swinging * excess, nan=np.inf), FINER[0], FINER[-1])
    steps = np.minimum(outcome.steps * 2 ** np.ceil(np.log2(times)).astype(np.int64), MOST_SUBSTEPS)
    doubtful = _doubtful(excess)
    return doubtful, np.where(doubtful, steps, outcome.steps)


def agree(one: Outcome, finer: Outcome) -> Mask:
    """Rollouts that tell the same in both, (count,): RMSE and error at the end, and whether and when they failed."""
    same: Mask = (one.failed == finer.failed) & (np.abs(one.until - finer.until) <= RELATIVE * finer.until)
    for name, share in (("rmse", HALF), ("steady_state", HALF * AT_THE_END)):
        coarse, fine = one.metrics[name], finer.metrics[name]
        same &= (np.abs(coarse - fine) <= share * tolerance(fine)) | (np.isnan(coarse) & np.isnan(fine))
    return same


def _difference(one: Outcome, finer: Outcome) -> Array:
    """Greater difference of RMSE and of error at the end, (count,) [rad]; inf where only one has them."""
    apart = [np.abs(one.metrics[name] - finer.metrics[name]) for name in ("rmse", "steady_state")]
    largest: Array = np.nan_to_num(np.maximum(*apart), nan=np.inf)
    return largest


def has_kinks(loop: Loop) -> bool:
    """Whether forces on the wrist have kinks: friction and slack of elastic tendons, end stops, or inner friction."""
    plant = loop.plant
    return loop.actuator.winds or plant.end_stop_deg is not None or plant.inner_friction > 0.0


def more_finely(loop: Loop, times: int) -> Loop:
    """The loop with so many times the integration steps."""
    return loop.model_copy(update={"substeps": times * loop.steps})


def settled(
    outcome: Outcome,
    run: Callable[[Rollouts, int], Outcome],
    by_hand: Mask,
    kinked: Mask,
    bears: Array,
    stop: Event,
) -> Outcome:
    """The outcome with the rollouts that are in doubt taken at steps that are short enough.

    `run` takes some of the rollouts at so many times the steps. A rollout has converged where its numbers stay the same
    twice in a row; the longest of these steps is taken. Where that never happens the shortest is, and the rollout is
    marked; so is, without trying all of them, a loop with kinks that swings at three steps and at each differently: it
    is chaotic (`kinked` and `bears` as in `in_doubt`). Steps given `by_hand` (count,) stay; such a rollout is marked
    where half of the step tells something else.
    """
    doubtful = in_doubt(outcome, kinked, bears)
    fixed, left = np.flatnonzero(doubtful & by_hand), np.flatnonzero(doubtful & ~by_hand)
    if len(fixed):
        before, fine = outcome.rows(fixed), run(fixed, 2)
        outcome.drift[fixed] = np.where(agree(before, fine), 0.0, _difference(before, fine))
    before, earlier = outcome.rows(left), outcome.rows(left)
    stayed, chaotic = np.zeros(len(left), bool), kinked[left] & _swinging(before, kinked[left])
    for times in FINER:
        if not len(left) or stop.is_set():
            return outcome
        fine = run(left, times)
        same = agree(before, fine)
        chaotic &= _swinging(fine, kinked[left]) & ~same
        given_up = chaotic if times > FINER[0] else np.zeros(len(left), bool)
        if times == FINER[-1]:
            given_up = ~(same & stayed)
        fine.drift[given_up] = np.maximum(_difference(before, fine), _difference(earlier, fine))[given_up]
        for over, result in ((given_up, fine), (same & stayed, earlier)):
            outcome = outcome.replaced(left[over], result.rows(np.flatnonzero(over)))
        remaining = np.flatnonzero(~given_up & ~(same & stayed))
        left, stayed, chaotic = left[remaining], same[remaining], chaotic[remaining]
        earlier, before = before.rows(remaining), fine.rows(remaining)
    return outcome
