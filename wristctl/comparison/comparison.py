"""Controllers x loops x references x inverses: every combination rolled out under the same conditions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wristctl.comparison.paper import T2, verdict
from wristctl.config.control import CompareSettings, TuneSettings
from wristctl.config.errors import UserError
from wristctl.config.loop import DirectionName, Reference
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.simulation.closed_loop import Simulation, simulation
from wristctl.simulation.reference import Motion, motion
from wristctl.simulation.rollout import rollout, sample_period
from wristctl.wrist.directions import DIRECTIONS, in_plane
from wristctl.wrist.kinematics import Inverse

if TYPE_CHECKING:
    import pandas as pd

Gains = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True)
class ComparedRow:
    """One controller with one set of gains on one loop, reference and inverse."""

    loop: str
    reference: str
    inverse: str
    controller: str
    gains: str
    simulation: Simulation

    @property
    def label(self) -> str:
        """controller/gains"""
        return f"{self.controller}/{self.gains}"


def reference_name(reference: Reference) -> str:
    """A short name: kind, duration and target."""
    if reference.kind == "tip-path":
        return f"tip path {reference.duration:g} s {' '.join(_millimetres(tip) for tip in reference.tips)}"
    if reference.kind == "multi-step":
        return f"steps {reference.duration:g} s {' '.join(f'{angle:g}' for angle in reference.angles_deg)} deg"
    target = f"{reference.end_deg:g} deg" if reference.tip is None else f"tip {_millimetres(reference.tip)} mm"
    how = {"step": "step", "sine": f"sine {reference.frequency:g} Hz"}
    return f"{how.get(reference.kind, f'minimum jerk {reference.duration:g} s')} {target}"


def _millimetres(tip: tuple[float, float]) -> str:
    return f"{1e3 * tip[0]:.3g}, {1e3 * tip[1]:.3g}"


def refuse_tuned_scenarios(compared: CompareSettings, tuned: TuneSettings) -> None:
    """UserError if a controller was tuned on a scenario on which it would be judged."""
    for scenario in tuned.scenarios:
        for name, loop in compared.loops.items():
            same_loop = loop == tuned.loops[scenario.loop]
            for reference in compared.references:
                if same_loop and reference_name(reference) == reference_name(scenario.reference):
                    raise UserError(
                        f"the gains were tuned on a scenario that they would be judged on: "
                        f"{reference_name(reference)} on loop {name}",
                        where="compare.references",
                        fix="tune on other references, or judge on others",
                    )


def compare(
    study: Study,
    network: Inverse | None = None,
    tuned: Gains | None = None,
    progress: Callable[[float], None] | None = None,
) -> list[ComparedRow]:
    """Run every combination of the study's `compare` section.

    UserError for an unknown controller or gains, a missing network or tuned gains, before anything is run.
    """
    chosen = study.compare
    gains = [gains_of(controller(row.controller), row.gains, tuned) for row in chosen.rows]
    names = list(dict.fromkeys(row.controller for row in chosen.rows))
    planned = [
        (loop_name, loop, wrist, _motions(study, wrist, direction, sample_period(loop), network))
        for loop_name, loop in chosen.loops.items()
        for direction in chosen.directions
        for wrist in [in_plane(study.wrist, direction)]
    ]
    results: list[ComparedRow] = []
    for part, (loop_name, loop, wrist, motions) in enumerate(planned):
        labels, followed = zip(*motions, strict=True)
        for number, name in enumerate(names):
            rows = [i for i, row in enumerate(chosen.rows) if row.controller == name]
            batch = np.array([gains[i] for i in rows for _ in followed]).reshape(len(rows) * len(followed), -1)
            which = np.tile(np.arange(len(followed)), len(rows))
            base = (part * len(names) + number) / (len(names) * len(planned))

            def report(share: float, base: float = base) -> None:
                if progress is not None:
                    progress(base + share / (len(names) * len(planned)))

            outcome = rollout(controller(name), batch, followed, which, loop, wrist, record=True, progress=report)
            for index in range(len(batch)):
                row = chosen.rows[rows[index // len(followed)]]
                (reference, inverse), course = labels[which[index]], followed[which[index]]
                done = simulation(outcome, index, course, wrist, f"{name}/{row.gains_name}")
                results.append(ComparedRow(loop_name, reference, inverse, name, row.gains_name, done))
    return _in_order(results, chosen)


def _motions(
    study: Study, wrist: WristParameters, direction: DirectionName, period: float, network: Inverse | None
) -> list[tuple[tuple[str, str], Motion]]:
    chosen = study.compare
    planned: list[tuple[tuple[str, str], Motion]] = []
    for reference in chosen.references:
        toward = reference.mirrored() if DIRECTIONS[direction].sign < 0 else reference
        for inverse in chosen.inverses:
            course = motion(toward.model_copy(update={"inverse": inverse}), wrist, chosen.horizon, period, network)
            planned.append(((_course_name(reference, direction, chosen), inverse), course))
    return planned


def _course_name(reference: Reference, direction: DirectionName, chosen: CompareSettings) -> str:
    """The reference's name, with the direction where there are several."""
    return reference_name(reference) + (f", {direction}" if len(chosen.directions) > 1 else "")


def _in_order(results: Sequence[ComparedRow], chosen: CompareSettings) -> list[ComparedRow]:
    """By loop, reference, direction, row of the study, inverse."""
    loops = list(chosen.loops)
    references = [_course_name(r, direction, chosen) for r in chosen.references for direction in chosen.directions]
    rows = [(row.controller, row.gains_name) for row in chosen.rows]
    return sorted(
        results,
        key=lambda r: (
            loops.index(r.loop),
            references.index(r.reference),
            rows.index((r.controller, r.gains)),
            chosen.inverses.index(r.inverse),
        ),
    )


def series(results: Sequence[ComparedRow], every: int = 5) -> dict[str, NDArray[np.float64]]:
    """Courses over time, one row per result in their order, every fifth sample: arrays (results, T), SI units.

    segment_theta (results, T, segments) is for drawing, hence in single precision; nan beyond a plant's segments.
    """
    courses = [result.simulation.trajectory for result in results]
    columns = {
        "theta": [c.theta for c in courses],
        "tip_x": [c.tip[:, 0] for c in courses],
        "tip_y": [c.tip[:, 1] for c in courses],
        "theta_ref": [c.theta_ref for c in courses],
        "theta_desired": [c.theta_desired for c in courses],
        "tension_plus": [c.tension[:, 0] for c in courses],
        "tension_minus": [c.tension[:, 1] for c in courses],
        "time": [c.time for c in courses],
    }
    most = max(c.segment_theta.shape[1] for c in courses)
    columns["segment_theta"] = [
        np.pad(c.segment_theta, ((0, 0), (0, most - c.segment_theta.shape[1])), constant_values=np.nan) for c in courses
    ]
    stacked = {name: np.stack([each[::every] for each in values]) for name, values in columns.items()}
    return stacked | {"segment_theta": stacked["segment_theta"].astype(np.float32)}


def frame(results: Sequence[ComparedRow]) -> pd.DataFrame:
    """Every metric of every result beside the paper's T2, one row each."""
    import pandas as pd

    rows = []
    for result in results:
        metrics = result.simulation.metrics
        printed = T2.get(result.controller)
        rows.append(
            {
                "loop": result.loop,
                "reference": result.reference,
                "controller": result.controller,
                "gains": result.gains,
                "inverse": result.inverse,
                "failed": result.simulation.failed,
                **metrics,
                "paper_rmse": printed.rmse if printed else np.nan,
                "paper_settling": printed.settling if printed else np.nan,
                "paper_steady_state": printed.steady_state if printed else np.nan,
                "verdict": verdict(result.controller, metrics["rmse"], metrics["settling"], metrics["steady_state"]),
            }
        )
    return pd.DataFrame(rows)
