"""The page on a learnt policy: its environments are as the library has them, and it is judged on what laws are."""

from __future__ import annotations

from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.documented import script_of_docs
from wristctl.control.law import Controller
from wristctl.gym import OBSERVED, WristVectorEnv
from wristctl.simulation.cases import measure
from wristctl.simulation.drawn_worlds import drawn_cases


@pytest.fixture(scope="module")
def ppo() -> ModuleType:
    """docs/ppo.py, with few worlds and few wrists."""
    module = script_of_docs("ppo")
    module.WORLDS, module.COUNT = 2, 4  # type: ignore[attr-defined]
    return module


@pytest.mark.slow
def test_an_episodes_end_shows_its_last_sight_and_the_next_has_begun(ppo: ModuleType) -> None:
    study = ppo.study_of()
    wrists = ppo.Wrists(WristVectorEnv(4, study, ppo.RIG))
    wrists.seed(3)
    wrists.reset()
    steps = ppo.steps_of(study)
    for step in range(steps):
        seen, reward, ended, told = wrists.step(np.zeros((4, 1)))
        assert ended.all() == (step == steps - 1) and (reward <= 0.0).all()
    last = np.array([each["terminal_observation"] for each in told])
    at = [each.name for each in OBSERVED].index("theta_ref")
    assert all(each["TimeLimit.truncated"] for each in told) and np.abs(last[:, at]).max() > 0.05
    assert not np.array_equal(last, seen), "another episode"


@pytest.mark.slow
def test_a_policy_is_judged_as_a_law_that_does_the_same_is(ppo: ModuleType) -> None:
    """One that asks for no torque: spools still reel in what the reference shortens, so most of the way is made."""
    study = ppo.study_of()

    def still(seen: Any, deterministic: bool) -> tuple[Any, None]:
        return np.zeros((len(seen), 1)), None

    sight = SimpleNamespace(normalize_obs=lambda seen: seen)
    policy = SimpleNamespace(model=SimpleNamespace(predict=still), sight=sight)
    found = ppo.judged(study, policy)
    law = Controller("still", lambda now, wrist, gains, memory: 0.0, "a test", {}, {"default": {}}, plain=True)
    cases = drawn_cases(study.families[ppo.RIG], ppo.RIG, "test", study.seed, 2, study.wrist)
    known = measure(law, np.zeros((1, 0)), cases, study.wrist, ["rmse", "oscillation"])
    assert found.metrics["rmse"] == pytest.approx(known.metrics["rmse"], rel=0.02), "a sample in 5 ms, not each ms"
    assert found.metrics["oscillation"] == pytest.approx(known.metrics["oscillation"], rel=0.05, abs=1e-5)
    size = [np.sqrt(np.mean(np.square(each.motion.theta_ref))) for each in cases]
    missed = found.metrics["rmse"][0] / size
    assert (missed > 0.01).all() and (missed < 0.2).all() and not found.failed.any()
    assert (found.rests == known.rests).all()
    row = ppo.row_of("still", found)
    assert row.scores.shape == (2,) and row.lost == 0
    assert row.scores == pytest.approx(ppo.row_of("still", known).scores, rel=0.02)


@pytest.mark.slow
def test_a_policy_that_learns_for_a_second_pulls(ppo: ModuleType) -> None:
    policy = ppo.learnt(ppo.study_of(), 1.0 / 60.0)
    assert policy.steps > 0
    seen = np.zeros((1, len(OBSERVED)))
    assert policy.model.predict(policy.sight.normalize_obs(seen), deterministic=True)[0].shape == (1, 1)
