"""Predictions without a model: a mean of other runs, and a Gaussian process that has learnt a smooth map."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.identification.arc_robot import ArcRecording
from wristctl.identification.baselines import baselines, gaussian_process, mean_of_runs
from wristctl.identification.prediction_scores import score_of


def recording(
    name: str, spools: Array, measured: Array, fitted: NDArray[np.bool_] | bool, mass: float = 0.0
) -> ArcRecording:
    count = len(spools)
    known = np.broadcast_to(np.asarray(fitted, bool), (count,)).copy()
    block = np.arange(count) // 20
    time: Array = 0.1 * np.arange(float(count))
    return ArcRecording(
        name, name, time, spools, measured, np.full(count, 0.1), known, np.zeros(count, bool), ~known, block, mass
    )


def swept(count: int, seed: int) -> tuple[Array, Array]:
    """Spools (T, 2), and a smooth map of them (T, 2) of which one bend is not measured."""
    spools = 5e-3 * np.random.default_rng(seed).uniform(-1.0, 1.0, (count, 2))
    bend = np.sin(200.0 * spools[:, 0]) + 100.0 * spools[:, 1]
    return spools, np.stack([bend, np.full(count, np.nan)], axis=1)


def test_a_process_predicts_a_smooth_map_of_the_spools_and_of_the_mass() -> None:
    parts = [recording(str(mass), *swept(200, k), True, mass) for k, mass in enumerate((0.0, 1.0))]
    parts = [recording(one.name, one.spools, one.measured + 0.5 * one.mass, True, one.mass) for one in parts]
    spools, bends = swept(100, 7)
    asked = recording("asked", spools, bends + 0.25, False, 0.5)
    predicted = gaussian_process([*parts, asked])[2]
    assert np.abs(predicted[:, 0] - asked.measured[:, 0]).max() < 0.1 and np.isnan(predicted[:, 1]).all()


def test_noise_is_not_learnt_by_heart() -> None:
    spools, bends = swept(300, 0)
    noise = 0.1 * np.random.default_rng(1).standard_normal(bends.shape)
    new, true = swept(100, 2)
    whole = recording("a", np.concatenate([spools, new]), np.concatenate([bends + noise, true]), np.arange(400) < 300)
    wrong = gaussian_process([whole])[0][300:, 0] - true[:, 0]
    assert np.sqrt(np.mean(wrong**2)) < 0.05


def test_the_mean_is_that_of_whole_runs_at_each_instant_or_of_all_that_is_known() -> None:
    spools, wave = np.zeros((100, 1)), np.sin(0.1 * np.arange(100.0))[:, None]
    runs = [recording("a", spools, wave + 1.0, True), recording("b", spools, wave - 0.5, True)]
    asked = recording("c", spools, wave, False)
    np.testing.assert_allclose(mean_of_runs([*runs, asked])[2], wave + 0.25)
    np.testing.assert_allclose(mean_of_runs([runs[0], asked])[1], np.full((100, 1), wave.mean() + 1.0))


@pytest.mark.parametrize("centred", [False, True])
def test_baselines_are_scored_on_what_was_predicted(centred: bool) -> None:
    spools, bends = swept(200, 3)
    parts = [recording("a", spools, np.nan_to_num(bends) + 2.0, np.arange(200) < 100)]
    scores = {name: score_of(found) for name, found in baselines([parts], centred).items()}
    known, asked = (np.nan_to_num(bends)[rows] + 2.0 for rows in (slice(0, 100), slice(100, 200)))
    wrong = known.mean(axis=0) - asked
    wrong = wrong - wrong.mean(axis=0) * centred
    assert scores["mean of the other runs"].error == pytest.approx(np.sqrt(np.mean(np.sum(wrong**2, axis=1))))
    assert scores["Gaussian process"].error < 0.1 * scores["mean of the other runs"].error
    assert scores["Gaussian process"].blocks == 5
