"""Draws of what trials leave open: their spread is that of the intervals, their correlations those of the fit."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from wristctl.commands.compare.answer import best_on_yours
from wristctl.comparison.world_ranking import WorldRanking
from wristctl.config.families import Family
from wristctl.config.identify import IdentifySettings
from wristctl.config.plant import Actuator
from wristctl.config.wrist import WristParameters
from wristctl.identification.fit import Fit
from wristctl.identification.intervals import Knowledge, inverse
from wristctl.identification.posterior import FAMILY, posterior_draws, posterior_yaml
from wristctl.identification.problem import Problem
from wristctl.identification.unknowns import believed_of, identified_yaml
from wristctl.simulation.drawn_worlds import world_of
from wristctl.study_files.load import load_study

CAMERA = {"frame_rate": 60.0, "delay_frames": 2.0}


def _known() -> tuple[Fit, Knowledge]:
    """A fit in which stiffness and damping are known to 10 and 20 %, and rise together."""
    start = believed_of(WristParameters(), Actuator())
    fixed = {"flexion_ratio": 1.0, "tendon_stiffness": 2e4, "friction": 0.1, "sheath_friction": 0.0, "presliding": 2e-5}
    settings = IdentifySettings.model_validate({"fix": {**fixed, "delay": 0.01, "tendon_radius": 0.02}})
    problem = Problem([], start, settings, Actuator())
    fit = Fit.__new__(Fit)
    object.__setattr__(fit, "problem", problem)
    object.__setattr__(fit, "x", problem.begin())
    correlation = np.array([[1.0, 0.8], [0.8, 1.0]])
    knowledge = Knowledge(np.array([0.1, 0.2]), inverse(correlation), 1.0, 0.0, 1.0, np.zeros(2))
    return fit, knowledge


def test_draws_spread_as_the_intervals_and_keep_correlations() -> None:
    fit, knowledge = _known()
    assert fit.problem.free == ("stiffness", "damping")
    draws = posterior_draws(fit, knowledge, 4000, np.random.default_rng(0))
    logs = np.log([[draw["stiffness"], draw["damping"]] for draw in draws])
    np.testing.assert_allclose(np.std(logs, axis=0), [0.1, 0.2], rtol=0.05)
    np.testing.assert_allclose(np.corrcoef(logs.T)[0, 1], 0.8, atol=0.03)
    np.testing.assert_allclose(
        np.exp(logs.mean(axis=0)), [WristParameters().stiffness, WristParameters().damping], rtol=0.02
    )


@pytest.mark.parametrize("period", [0.01, 0.02])
def test_the_family_of_a_posterior_is_worlds_of_these_wrists(tmp_path: Path, period: float) -> None:
    fit, knowledge = _known()
    draws = posterior_draws(fit, knowledge, 20, np.random.default_rng(1))
    values = fit.problem.values(fit.x)
    file = tmp_path / "posterior.yaml"
    file.write_text(identified_yaml(values, CAMERA) + posterior_yaml(draws, values, CAMERA, period))
    family = load_study([file]).families[FAMILY]
    assert family.loop.control_period == min(period, 1.0 / CAMERA["frame_rate"])
    plants = [world_of(family, FAMILY, "test", 0, number).plant for number in range(30)]
    assert {plant.stiffness for plant in plants} <= {draw["stiffness"] for draw in draws}
    by_stiffness = {draw["stiffness"]: draw["damping"] for draw in draws}
    assert all(plant.damping == by_stiffness[float(str(plant.stiffness))] for plant in plants)
    assert len({plant.stiffness for plant in plants}) > 8


def test_the_probability_of_being_best_is_the_share_of_draws_with_the_least_error() -> None:
    ranking = object.__new__(WorldRanking)
    scores = np.array([[1.0, 1.0, 2.0, 1.0, np.inf], [2.0, 2.0, 1.0, 3.0, np.inf]])
    traits = SimpleNamespace(jumps=False)
    family = Family(together=({"plant.stiffness": 0.5},))
    parts = {"scores": scores, "labels": ["a", "b"], "traits": traits, "family": family}
    for name, part in parts.items():
        object.__setattr__(ranking, name, part)
    text = best_on_yours([ranking])
    assert text.startswith("a is best on your robot with probability 0.60 (95 % 0.15 to 0.95)") and "3 of 5" in text
    object.__setattr__(ranking, "family", Family())
    assert best_on_yours([ranking]) == ""
