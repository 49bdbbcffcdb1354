"""A controller from elsewhere takes part everywhere once it stands in the table."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from wristctl.comparison.combinations import compare
from wristctl.config.study import Study
from wristctl.control.law import Controller, Gain
from wristctl.control.table import CONTROLLERS
from wristctl.seeds import stream
from wristctl.simulation.closed_loop import simulate
from wristctl.tuning.objective import Judge
from wristctl.tuning.search import search, tuning_cases


def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """-k (theta - theta_ref)"""
    return -gains.k * (now.theta - now.theta_ref)


NEWCOMER = Controller(
    name="newcomer",
    law=law,
    source="a test",
    gains={"k": Gain("N m/rad", "spring", 1e-2, 1e4)},
    presets={"default": {"k": 2.0}},
)


@pytest.fixture(autouse=True)
def registered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(CONTROLLERS, "newcomer", NEWCOMER)


def test_newcomer_is_simulated_tuned_and_compared_without_another_change() -> None:
    study = Study.model_validate(
        {
            "simulate": {"controller": "newcomer", "gains": "default", "horizon": 1.0},
            "tune": {"controllers": ("newcomer",), "candidates": 4, "iterations": 2, "horizon": 1.0},
            "compare": {
                "rows": ({"controller": "newcomer", "gains": "default"}, {"controller": "newcomer", "gains": "tuned"}),
                "loops": {"default": {}},
                "inverses": ("none",),
                "horizon": 1.0,
            },
        }
    )
    assert simulate(study).first.metrics["rmse"] > 0.0
    judge = Judge(tuning_cases(study)[0], study.wrist, study.tune.objective)
    found = search(study, NEWCOMER, lambda name: stream(0, name), (judge, None))
    assert 1e-2 <= found.gains["k"] <= 1e4
    results = compare(study, tuned={"newcomer": found.gains})
    assert {result.label for result in results} == {"newcomer/default", "newcomer/tuned"}
    assert all(np.isfinite(result.simulation.metrics["rmse"]) for result in results)
