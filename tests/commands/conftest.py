"""Tiny studies, and what each function of the face makes of them in memory and in a run directory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wristctl
from wristctl.commands.inputs import Given, Inputs
from wristctl.commands.progress import watched
from wristctl.commands.results import Findings
from wristctl.commands.session import Session, Unattended
from wristctl.config.study import Study
from wristctl.records import LiveRun, Run
from wristctl.simulation.metrics import METRICS
from wristctl.simulation.repetitions import Repeated, Simulation
from wristctl.simulation.trajectory import Trajectory

SMALL = (
    "seed=3", "gen-data.samples=40", "train={hidden: [4], activation: tanh, epochs: 3, workers: 1}",
    "tune={controllers: [smc, pid], candidates: 2, iterations: 2, horizon: 0.3, loops: {fast: {plant_segments: 1}}, "
    "scenarios: [{loop: fast, reference: {kind: step, angle_deg: 20.0}}]}",
    "compare={horizon: 0.3, loops: {fast: {plant_segments: 1}}, references: [{duration: 0.2}], inverses: [network], "
    "controllers: [{controller: smc, gains: tuned}, {controller: feedforward}]}",
    "simulate={horizon: 0.3, gains: tuned, loop: {plant_segments: 1}, reference: {duration: 0.2, inverse: network}}",
    "hysteresis={ranges_deg: [[0.0, 10.0]], frequencies: [2.0, 5.0], sheaths: [1.0], angles_deg: [5.0], ramp: 0.2}",
    "audit={horizon: 0.1, claims: [{id: C2, says: a sign, evidence: text, verdict: contradicted, reason: by hand}, "
    "{id: T1, says: R2, evidence: table1, value: 0.9, metric: r2}]}",
)  # fmt: skip


@pytest.fixture(scope="session")
def study() -> Study:
    """A study that takes a moment."""
    return wristctl.load_study(None, *SMALL)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A results folder for a whole module."""
    return tmp_path_factory.mktemp("face") / "results"


def course(label: str, diverges: bool = False) -> Trajectory:
    """An exponential approach to 30 deg, sampled every 10 ms for two seconds, on one segment."""
    time = 0.01 * np.arange(200.0)
    wanted = np.full(200, np.radians(30.0))
    theta = np.where(time < 1.0, np.expm1(time), np.nan) if diverges else wanted * -np.expm1(-5.0 * time)
    tip = np.column_stack([0.08 * np.cos(0.5 * theta), 0.08 * np.sin(0.5 * theta)])
    own = theta, theta[:, None], np.gradient(theta, time), wanted, wanted, tip, tip
    return Trajectory(label, time, *own, 0.1 * theta, 0.1 * theta, np.full((200, 2), [30.0, 2.0]))


def repeated(label: str, rmse: Sequence[float] = (1e-3,), failed: int = 0, **metrics: float) -> Repeated:
    """A loop done as often as there are RMSEs, the last `failed` of which failed.

    It does not swing and has converged; all else is 1.
    """
    every = {name: np.ones(len(rmse)) for name in METRICS}
    every |= {"rmse": np.array(rmse), "oscillation": np.zeros(len(rmse)), "drift": np.zeros(len(rmse))}
    every |= {name: np.full(len(rmse), value) for name, value in metrics.items()}
    bad = np.arange(len(rmse)) >= len(rmse) - failed
    one = course(label, bool(bad[0]))
    first = Simulation(one, {name: float(values[0]) for name, values in every.items()}, bool(bad[0]), 0.5)
    return Repeated(first, every, bad, np.full(len(bad), 0.5), one.error[None])


def session(study: Study, run: LiveRun | None = None, inputs: Mapping[str, Given] | None = None) -> Session:
    """A session in which nobody watches."""
    return Session(study, Inputs(inputs), Findings(study.seed, run), watched(None), Unattended())


def columns_of(run: Run, file: str) -> dict[str, tuple[str, str]]:
    """Unit and meaning of each column of a table, as the manifest has them."""
    found = next(each for each in run.manifest.outputs if each.path == file)
    return {each.name: (each.unit, each.meaning) for each in found.columns}


def known_of(findings: Findings, *names: str) -> list[tuple[Any, ...]]:
    """Unit, better direction and n of these metrics."""
    return [tuple(findings.metrics[name][each] for each in ("unit", "better", "n")) for name in names]
