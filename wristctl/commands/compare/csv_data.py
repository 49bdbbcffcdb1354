"""A comparison as data: courses over time, and every metric beside the paper's numbers."""

from __future__ import annotations

from collections.abc import Container, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wristctl.comparison.combinations import ComparedRow
from wristctl.comparison.paper import T2, Printed, verdict
from wristctl.comparison.repetition_spread import spread

if TYPE_CHECKING:
    import pandas as pd


# Columns of trajectories that are kept, in one plane and in two.
_DRAWN = ("theta", "tip_x", "tip_y", "theta_ref", "theta_desired", "tension_plus", "tension_minus", "time")
_IN_SPACE = ("bend_ulnar", "bend_flexion", "tip_x", "tip_y", "tip_z", "bend_ref_ulnar", "bend_ref_flexion", "time")


def series(results: Sequence[ComparedRow], every: int = 5) -> dict[str, NDArray[np.float64]]:
    """Courses over time, one row per result in their order, every fifth sample: arrays (results, T), SI units.

    Where loops are sampled at different rates each gives its samples nearest to those of the slowest.
    segment_theta (results, T, segments) is for drawing, hence in single precision; nan beyond a plant's segments.
    """
    courses = [result.simulation.trajectory for result in results]
    kept = _kept([c.time for c in courses], every)
    most = max(c.segment_theta.shape[1] for c in courses)
    drawn = [c.columns() for c in courses]
    columns = {name: [each[name] for each in drawn] for name in (_DRAWN if courses[0].planes == 1 else _IN_SPACE)}
    if courses[0].planes == 2:
        places = courses[0].tension.shape[1]
        columns |= {f"pull_{t + 1}": [c.tension[:, t] for c in courses] for t in range(places)}
    columns["segment_theta"] = [
        np.pad(c.segment_theta, ((0, 0), (0, most - c.segment_theta.shape[1])), constant_values=np.nan) for c in courses
    ]
    stacked = {
        name: np.stack([values_of_run[indices] for values_of_run, indices in zip(values, kept, strict=True)])
        for name, values in columns.items()
    }
    return stacked | {"segment_theta": stacked["segment_theta"].astype(np.float32)}


def _kept(times: Sequence[NDArray[np.float64]], every: int) -> list[NDArray[np.intp]]:
    """Indices of the kept samples of each course, at instants as nearly common to all as possible."""
    steps = [float(time[1] - time[0]) for time in times]
    apart = max(every * min(steps), max(steps))
    end = min(float(time[-1]) for time in times)
    instants = apart * np.arange(int(end / apart * (1.0 + 1e-9)) + 1)
    return [
        np.round(instants / step).astype(np.intp).clip(max=len(time) - 1)
        for time, step in zip(times, steps, strict=True)
    ]


def metrics_of(result: ComparedRow) -> dict[str, float]:
    """The metrics of a row: medians where it was repeated."""
    repeated = result.repeated
    if len(repeated.failed) == 1:
        return result.simulation.metrics
    return {name: spread(values).median for name, values in repeated.metrics.items()}


def frame(results: Sequence[ComparedRow], cells: Container[tuple[str, str]]) -> pd.DataFrame:
    """Every metric of every result, one row each, and the paper's T2 beside those of the `cells` (loop, reference).

    Where rows were repeated a metric is the median, `<metric>_low` and `<metric>_high` are the ends of its 95 %
    interval, `repetitions` says how many there were and `failed` whether any of them failed.
    """
    import pandas as pd

    repeated = any(len(result.repeated.failed) > 1 for result in results)
    rows = []
    for result in results:
        metrics, theirs = metrics_of(result), (result.loop, result.reference) in cells
        printed = T2.get(result.controller) if theirs else None
        row: dict[str, Any] = _names(result) | {"failed": bool(result.repeated.failed.any())} | metrics
        if repeated:
            spreads = {name: spread(values) for name, values in result.repeated.metrics.items()}
            row |= {f"{name}_low": each.low for name, each in spreads.items()}
            row |= {f"{name}_high": each.high for name, each in spreads.items()}
            row["repetitions"] = len(result.repeated.failed)
        row |= {
            "paper_rmse": printed.rmse if printed else np.nan,
            "paper_settling": printed.settling if printed else np.nan,
            "paper_steady_state": printed.steady_state if printed else np.nan,
            "verdict": verdict(result.controller, *(metrics[name] for name in Printed._fields)) if printed else "",
        }
        rows.append(row)
    return pd.DataFrame(rows)


def repetitions_frame(results: Sequence[ComparedRow]) -> pd.DataFrame:
    """Every repetition of every result, one row each."""
    import pandas as pd

    return pd.DataFrame(
        [
            _names(result)
            | {"repetition": k, "failed": bool(result.repeated.failed[k])}
            | {name: values[k] for name, values in result.repeated.metrics.items()}
            for result in results
            for k in range(len(result.repeated.failed))
        ]
    )


def _names(result: ComparedRow) -> dict[str, Any]:
    return {
        "loop": result.loop,
        "reference": result.reference,
        "controller": result.controller,
        "gains": result.gains,
        "inverse": result.inverse,
    }
