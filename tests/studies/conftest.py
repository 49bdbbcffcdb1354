"""Tiny studies, and what each function of the face makes of them in memory and in a run directory."""

from __future__ import annotations

from pathlib import Path

import pytest

import wristctl
from wristctl.config.study import Study

SMALL = (
    "seed=3", "gen-data.samples=40", "train={hidden: [4], activation: tanh, epochs: 3, workers: 1}",
    "tune={controllers: [smc, pid], candidates: 2, iterations: 2, horizon: 0.3, loops: {fast: {plant_segments: 1}}, "
    "scenarios: [{loop: fast, reference: {kind: step, angle_deg: 20.0}}]}",
    "compare={horizon: 0.3, loops: {fast: {plant_segments: 1}}, references: [{duration: 0.2}], inverses: [network], "
    "rows: [{controller: smc, gains: tuned}, {controller: feedforward}]}",
    "simulate={horizon: 0.3, gains: tuned, loop: {plant_segments: 1}, reference: {duration: 0.2, inverse: network}}",
    "audit={horizon: 0.1, claims: [{id: C2, says: a sign, evidence: text, verdict: contradictory, reason: by hand}, "
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
