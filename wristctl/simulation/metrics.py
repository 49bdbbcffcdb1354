"""Metrics of one closed loop, each with formula, unit and heading: the entries of `wristctl.config.choices.METRICS`.

e = theta - theta_ref (E12), in two planes a vector and |e| its norm, sampled at the control ticks; T is the horizon.
The move is the time until the reference rests; a reference that does not rest before the horizon has neither settling
time nor overshoot, which is along the move. Tensions are those that act, of one tendon of each place: a side in one
plane. Of all metrics less is better.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.choices import METRICS as _TABLE
from wristctl.config.choices import Choices
from wristctl.simulation.arrival import missing
from wristctl.simulation.motion import GOALS, Goals
from wristctl.simulation.oscillation import hunting, oscillation
from wristctl.simulation.stick_slip import jump, plateau
from wristctl.simulation.trajectory import PLANES, Trajectory, size_of


def energy(power: Array, step: float) -> Any:
    """Integral of |power| [J] over powers [W] (..., T), torque times rate of all planes, sampled every `step` [s]."""
    return np.abs(power).sum(axis=-1) * step


def course_energy(course: Trajectory) -> float:
    """Energy of one course, as `energy` takes it of many."""
    power = (course.torque * course.rate).reshape(len(course.time), -1).sum(axis=1)
    return float(energy(power, float(course.time[1] - course.time[0])))


_ANGLE = float(np.deg2rad(0.01))
# Move [rad] below which there is nothing to settle on.
_LEAST_MOVE = 1e-9


class Totals(NamedTuple):
    """Sums over rollouts and goals of their motions, (count,) each, by the names of `wristctl.simulation.sums` (SUMS,
    in two planes OF_BENDS too) and of GOALS."""

    sums: Mapping[str, Array]
    goals: Mapping[str, Array]
    period: float
    """Between two ticks [s]."""


@dataclass(frozen=True)
class Metric:
    """One number of a closed loop; it comes from running sums (of many rollouts at once) or from a trajectory."""

    unit: str
    formula: str
    of_totals: Callable[[Totals], Array] | None = None
    of_trajectory: Callable[[Trajectory], float] | None = None
    heading: str = ""
    """Over its column where people read a table; without one it is in data files only."""
    of_error: bool = True
    """Whether it is of the error, and so means nothing where the wrist has diverged."""
    never: Callable[[float], float] | None = None
    """Value of `never` (nan) in tuning, by the horizon [s]; None: such gains have failed."""
    floor: float = 1e-3
    """In tuning, below which a difference is of no interest; in its unit."""


METRICS: Choices[Metric] = _TABLE


def summary(totals: Totals, metrics: Mapping[str, Metric] = METRICS) -> dict[str, Array]:
    """The metrics that come from sums, each (count,); of the error nan where the wrist has diverged."""
    alive = totals.sums["alive"] > 0.0
    values = {}
    with np.errstate(divide="ignore", invalid="ignore"):
        for name, metric in metrics.items():
            if metric.of_totals is not None:
                value = metric.of_totals(totals)
                values[name] = np.where(alive, value, np.nan) if metric.of_error else value
    return values


def summed() -> dict[str, Metric]:
    """The metrics that come from sums, by name: those that a recorded series has."""
    return {name: metric for name, metric in METRICS.items() if metric.of_totals is not None}


def metrics_in(planes: int) -> Mapping[str, Metric]:
    """The metrics of loops in so many planes: in two those of each plane come first."""
    if planes == 1:
        return METRICS
    told = {name: replace(METRICS[name], formula=formula) for name, formula in _IN_TWO_PLANES.items()}
    return {**OF_TWO_PLANES, **METRICS, **told}


def of_trajectory(trajectory: Trajectory) -> dict[str, float]:
    """The metrics that come from a trajectory."""
    chosen = {name: metric.of_trajectory for name, metric in METRICS.items() if metric.of_trajectory is not None}
    return {name: float(value(trajectory)) for name, value in chosen.items()}


def metrics_of(
    period: float,
    bend: Array,
    bend_ref: Array,
    tension: Array,
    goals: Goals,
    saturated: Array | None = None,
) -> dict[str, float]:
    """Metrics of one recorded series, sampled every `period` [s]: bends (T,) or (T, P) [rad], tensions of one tendon
    of each place (T, places) [N].

    `goals` are those of the reference (`Motion.goals`), `saturated` (T,) where the torque was out of reach.
    """
    flags = np.zeros(len(bend)) if saturated is None else np.asarray(saturated, float)
    every, wish = bend.reshape(len(bend), -1), bend_ref.reshape(len(bend), -1)
    totals = totals_of_series(period, every, wish, tension, flags, goals)
    return {name: float(value[0]) for name, value in summary(totals, metrics_in(every.shape[1])).items()}


def totals_of_series(period: float, bend: Array, wish: Array, tension: Array, saturated: Array, goals: Goals) -> Totals:
    """Sums of one recorded series, as `wristctl.simulation.sums.sums_of` takes it."""
    from wristctl.simulation.sums import sums_of  # compiled code, which the table does not need

    sums, rows = sums_of(period, bend, wish, tension, saturated, goals), goals.rows
    return Totals(sums, dict(zip(GOALS, rows[-len(GOALS) :, None], strict=True)), period)


def _rests(of: Totals) -> Any:
    return (of.goals["rest"] < of.goals["horizon"]) & (np.abs(of.goals["move"]) > _LEAST_MOVE)


def _settled(of: Totals, exit_: str) -> Any:
    return _rests(of) & (of.sums[exit_] < of.goals["horizon"] - 1.5 * of.period)


def _rmse_move(of: Totals) -> Array:
    sums, step = of.sums, of.goals["rest"] <= 0.0
    return np.sqrt(np.where(step, sums["squared"] / sums["ticks"], sums["squared_move"] / sums["ticks_move"]))


def _rmse_settled(of: Totals) -> Array:
    sums = of.sums
    after = np.round(sums["ticks"] - sums["exit_2"] / of.period) - 1.0
    rest_rms = np.sqrt((sums["squared"] - sums["squared_exit"]).clip(0.0) / after)
    return np.where(_settled(of, "exit_2"), rest_rms, np.nan)


def _settling(of: Totals) -> Array:
    return np.where(_settled(of, "exit_2"), of.sums["exit_2"], np.nan)


def _settling_5(of: Totals) -> Array:
    return np.where(_settled(of, "exit_5"), of.sums["exit_5"], np.nan)


def _overshoot(of: Totals) -> Array:
    return np.where(_rests(of), 100.0 * of.sums["overshoot"] / np.abs(of.goals["move"]), np.nan)


RMSE = Metric(
    "rad",
    "sqrt(mean e^2) over the horizon",
    lambda of: np.sqrt(of.sums["squared"] / of.sums["ticks"]),
    heading="RMSE [rad]",
    floor=_ANGLE,
)
RMSE_MOVE = Metric(
    "rad", "sqrt(mean e^2) until the reference rests; over the horizon for a step", _rmse_move, floor=_ANGLE
)
RMSE_SETTLED = Metric("rad", "sqrt(mean e^2) after the settling time (2 %)", _rmse_settled, floor=_ANGLE)
SETTLING = Metric(
    "s",
    "last instant outside +-2 % of the move around the final reference; never: nan",
    _settling,
    heading="settling [s]",
    never=lambda horizon: horizon,
    floor=0.01,
)
SETTLING_5 = Metric("s", "the same for +-5 %", _settling_5, never=lambda horizon: horizon, floor=0.01)
STEADY_STATE = Metric(
    "rad",
    "mean |e| over the last 10 % of the horizon",
    lambda of: of.sums["late"] / of.sums["late_count"],
    heading="steady [rad]",
    floor=_ANGLE,
)
MISSING = Metric(
    "",
    "mean |e| at the end as a share of the largest reference: more than a fifth does not arrive",
    of_trajectory=missing,
    floor=1e-3,
)
OVERSHOOT = Metric(
    "%",
    "largest passing of the final reference over the last move, from that move's beginning",
    _overshoot,
    heading="overshoot [%]",
    floor=0.1,
)
IAE = Metric("rad s", "integral of |e|", lambda of: of.sums["absolute"] * of.period, floor=_ANGLE)
PEAK_TENSION = Metric(
    "N",
    "largest tension of a tendon",
    lambda of: of.sums["peak"],
    heading="peak [N]",
    of_error=False,
    floor=0.1,
)
RMS_TENSION = Metric(
    "N",
    "sqrt(mean of both sides' squared tensions)",
    lambda of: np.sqrt(of.sums["squared_tension"] / of.sums["ticks"]),
    of_error=False,
    floor=0.1,
)
CHATTERING = Metric(
    "N/s",
    "total variation of both sides' tensions per second",
    lambda of: of.sums["variation"] / of.goals["horizon"],
    heading="chattering [N/s]",
    of_error=False,
    floor=1.0,
)
SATURATION = Metric(
    "",
    "share of time in which the wanted torque was out of the tendons' reach",
    lambda of: of.sums["saturated"] / of.sums["ticks"],
    heading="saturated",
    of_error=False,
    floor=0.001,
)
MOTOR_LIMITED = Metric(
    "",
    "share of time in which motors' speed, acceleration or lag kept a part of the command from the wrist",
    lambda of: of.sums["limited"] / of.sums["ticks"],
    of_error=False,
    floor=0.001,
)
SLACK = Metric(
    "",
    "share of time in which a tendon was slack",
    lambda of: of.sums["slack"] / of.sums["ticks"],
    of_error=False,
    floor=0.001,
)
ENERGY = Metric("J", "integral of |torque * rate|: work on the wrist", of_trajectory=course_energy, of_error=False)
RMSE_DESIRED = Metric(
    "rad",
    "RMSE against the true wanted angle",
    of_trajectory=lambda course: np.sqrt(course.planes * np.mean((course.theta - course.theta_desired) ** 2)),
    floor=_ANGLE,
)
TIP_RMSE = Metric(
    "mm",
    "RMS distance of the tip from that of one arc bent as wanted; several segments bend unevenly under their weight",
    of_trajectory=lambda course: 1e3 * np.sqrt(np.mean(course.tip_distance**2)),
    floor=0.02,
)
TIP_STEADY = Metric(
    "mm",
    "mean distance of the tip from that of one arc bent as wanted, over the last 10 %",
    of_trajectory=lambda course: 1e3 * course.tip_distance[-max(1, len(course.time) // 10) :].mean(),
    floor=0.02,
)
OSCILLATION = Metric(
    "rad",
    "half the peak-to-peak of the angle over the last second at rest, its trend removed",
    of_trajectory=oscillation,
    heading="oscillation [rad]",
    floor=2.0 * _ANGLE,
)
HUNTING = Metric(
    "rad",
    "half the peak-to-peak of the angle over the last half of a hold of at least 20 s, its trend removed",
    of_trajectory=hunting,
    floor=2.0 * _ANGLE,
)
PLATEAU = Metric(
    "s",
    "longest time in which the reference moves by more than 1 deg/s and the angle by less than a tenth of that",
    of_trajectory=plateau,
    floor=0.01,
)
JUMP = Metric(
    "rad",
    "largest motion beyond the reference's own within 0.1 s after such a rest of at least 0.05 s",
    of_trajectory=jump,
    floor=2.0 * _ANGLE,
)
SUBSTEPS = Metric(
    "",
    "integration steps in a control period that it took",
    of_trajectory=lambda course: float(course.substeps),
    of_error=False,
)
DRIFT = Metric(
    "rad",
    "change of RMSE or of the error at the end with the integration step, at the shortest tried; 0: converged",
    of_trajectory=lambda course: course.drift,
    of_error=False,
    floor=_ANGLE,
)
OBSERVER = Metric(
    "",
    "RMS of the observer's error over what it expects by what it believes: 1 where that is so",
    of_trajectory=lambda course: course.consistency,
)
OUTSIDE_DOMAIN = Metric(
    "", "share of the wanted tips outside the network's trained domain", of_trajectory=lambda course: course.outside
)


WITHIN = np.deg2rad(2.0)
BIN = np.deg2rad(1.0)


def range_untracked(course: Trajectory) -> float:
    """Share of the wanted range in which the bend was ever off by more than 2 deg, by bins of 1 deg in each plane.

    Bins that a motion jumps over are no part of its range.
    """
    wanted = course.theta_desired.reshape(len(course.time), -1)
    bins = np.floor((wanted - wanted.min(axis=0)) / BIN + 1e-9).astype(np.int64)
    passed, which = np.unique(bins, axis=0, return_inverse=True)
    worst = np.zeros(len(passed))
    np.maximum.at(worst, which.reshape(-1), np.nan_to_num(size_of(course.bend - wanted), nan=np.inf))
    return float(np.mean(worst > WITHIN))


RANGE_UNTRACKED = Metric(
    "",
    "share of the wanted range, in bins of 1 deg, in which the angle was ever off by more than 2 deg",
    of_trajectory=range_untracked,
    floor=0.01,
)


def _settling_after(of: Totals) -> Array:
    assert SETTLING.of_totals is not None
    return np.maximum(SETTLING.of_totals(of) - of.goals["rest"], 0.0)


SETTLING_AFTER = Metric(
    "s",
    "settling time from when the reference rests; 0 where the angle is within +-2 % by then; never: nan",
    _settling_after,
    never=lambda horizon: horizon,
    floor=0.01,
)

# What is said of METRICS in two planes where sides are places, and angles vectors.
_IN_TWO_PLANES = {
    "rms_tension": "sqrt(mean of the squared tensions of all places)",
    "chattering": "total variation of the tensions of all places per second",
    "range_untracked": "share of the wanted cells of 1 deg by 1 deg in which |e| was ever more than 2 deg",
    "oscillation": "half the peak-to-peak over the last second at rest of the plane with most, its trend removed",
    "hunting": "half the peak-to-peak over the last half of a hold of at least 20 s of the plane with most",
}
# What loops in two planes have beside METRICS, whose e is the vector over both planes.
OF_TWO_PLANES: Mapping[str, Metric] = {
    **{
        f"rmse_{plane}": Metric(
            "rad", f"sqrt(mean e^2) over the horizon, toward {plane}",
            lambda of, name=f"squared_{plane}": np.sqrt(of.sums[name] / of.sums["ticks"]),  # type: ignore[misc]
        )
        for plane in PLANES
    },
    "largest_error": Metric(
        "rad", "largest |e| over both planes", lambda of: np.sqrt(of.sums["squared_most"]),
    ),
}  # fmt: skip
