"""Quantities of trials, and their means beside those of the simulation of the same trials."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from wristctl.commands.quantities import Quantity

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.simulation.repetitions import Simulation

_SPREAD, _AXIS = "standard deviation of the error", "the longer axis of its mean covariance"
_QUANTITIES = {
    quantity.name: quantity
    for quantity in (
        Quantity("trial"),
        Quantity("label", heading="controller"),
        Quantity("direction", heading="motion"),
        Quantity("force", "N", heading="push"),
        Quantity("push", "N"),
        Quantity("trials"),
        Quantity("rmse_ulnar", "rad", heading="RMSE toward ulnar"),
        Quantity("rmse_flexion", "rad", heading="RMSE toward flexion"),
        Quantity("rmse", "rad", heading="RMSE"),
        Quantity("largest_error", "rad"),
        Quantity("steady_state", "rad"),
        Quantity("settling", "s"),
        Quantity("recovery", "s"),
        Quantity("overshoot", "%"),
        Quantity("swing", "rad", heading="swing at rest, peak to peak"),
        Quantity("peak_tension", "N"),
        Quantity("error_major", "rad", f"{_SPREAD} along {_AXIS}", "long axis of the error"),
        Quantity("error_minor", "rad", f"{_SPREAD} across {_AXIS}", "short axis of the error"),
        Quantity(
            "error_toward", "rad", f"direction of {_AXIS}, from ulnar toward flexion", "direction of the long axis"
        ),
        Quantity("outcome"),
    )
}
ELLIPSE = ("error_major", "error_minor", "error_toward")
"""The ellipse of an error in two planes, as `ErrorEllipse` has its values."""
# Metrics of which means are taken, by the log and truly; and those also of the trials' simulation.
_BY_LOG = ("rmse_ulnar", "rmse_flexion", "rmse", "steady_state", "settling", "recovery")
OF_MEANS = (
    *_BY_LOG, *ELLIPSE, "true_rmse_ulnar", "true_rmse_flexion", "true_rmse", "true_steady_state", "true_recovery",
    *(f"true_{name}" for name in ELLIPSE),
)  # fmt: skip
_SIMULATED = ("rmse_ulnar", "rmse_flexion", "rmse", "steady_state")


def quantities(names: Iterable[str]) -> list[Quantity]:
    """Quantities of trials by name, after `true_` of the true bend, after `simulated_` of the trials' simulation."""
    found = []
    for name in names:
        begin, _, rest = name.partition("_")
        if begin in ("true", "simulated"):
            of_log = _QUANTITIES[rest]
            heading = f"{begin} {of_log.heading.partition(',')[0] or rest.replace('_', ' ')}"
            found.append(replace(of_log, name=name, heading=heading))
        else:
            found.append(_QUANTITIES[name])
    return found


def completed(trials: pd.DataFrame) -> pd.DataFrame:
    """Trials that ended well, with `label`, and their swings at rest from crest to crest [rad], by log and truly."""
    done = trials[trials["outcome"] == "ok"]
    swings = {f"{true}swing": 2.0 * done[f"{true}oscillation"] for true in ("", "true_")}
    return done.assign(label=done["controller"] + "/" + done["gains"], force=done["push"].abs(), **swings)


def with_simulation(done: pd.DataFrame, twins: Mapping[int, Simulation]) -> pd.DataFrame:
    """The trials with the metrics of their simulation as `simulated_...`."""
    names = [name for name in _SIMULATED if name in done]
    courses = [twins[number].metrics for number in done["trial"]]
    return done.assign(**{f"simulated_{name}": [metrics[name] for metrics in courses] for name in names})


def known_means(trials: pd.DataFrame) -> list[str]:
    """Names of the metrics of which these trials have means."""
    return [name for name in (*OF_MEANS, *(f"simulated_{name}" for name in _SIMULATED)) if name in trials]


def means(trials: pd.DataFrame) -> dict[str, float]:
    """Number of trials, and means of their metrics; nan where there is none, or where one of them has no value.

    Of ellipses of the error it is that of the mean covariance.
    """
    from wristctl.simulation.error_ellipse import ErrorEllipse, mean_ellipse

    values = trials[known_means(trials)].astype(float)
    found = {str(name): float(value) for name, value in values.mean(skipna=False).items()}
    for names in (ELLIPSE, tuple(f"true_{name}" for name in ELLIPSE)):
        if len(trials) and names[0] in values:
            ellipses = [ErrorEllipse(*row) for row in values[list(names)].itertuples(index=False)]
            found |= zip(names, mean_ellipse(ellipses), strict=True)
    return {"trials": len(trials), **found}
