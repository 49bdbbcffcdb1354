"""Which trials, in what order, and what their record shows of a push."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.trial.conftest import settings_of
from wristctl.trial.trials import push_seen, recovery, trials_of

TIME = np.arange(0.0, 5.0, 5e-3)


@given(st.integers(0, 2**32))
def test_every_trial_comes_once_and_the_wrist_is_turned_once(seed: int) -> None:
    settings = settings_of(directions=("ulnar", "radial", "flexion", "extension"), repetitions=3, push={"force": 2.0})
    trials = trials_of(settings, np.random.default_rng(seed))
    assert [trial.number for trial in trials] == list(range(24)) and len({t[1:] for t in trials}) == 24
    planes = [trial.plane for trial in trials]
    assert sum(one != other for one, other in pairwise(planes)) == 1
    assert trials == trials_of(settings, np.random.default_rng(seed))


def test_the_order_is_the_seeds() -> None:
    settings = settings_of(directions=("ulnar", "radial"), repetitions=4)
    orders = {tuple(trial[1:] for trial in trials_of(settings, np.random.default_rng(seed))) for seed in range(20)}
    assert len(orders) > 15


def test_recovery_is_the_time_until_the_error_stays_within_two_percent_of_the_move() -> None:
    error = np.where(TIME < 3.2, 0.02, 0.005)
    assert recovery(TIME, error, 0.5, 3.0) == pytest.approx(0.2, abs=1e-9)
    assert recovery(TIME, 0.0 * TIME, 0.5, 3.0) == 0.0
    assert np.isnan(recovery(TIME, 0.02 + 0.0 * TIME, 0.5, 3.0))


@given(st.floats(0.03, 0.5), st.sampled_from([-1.0, 1.0]), st.integers(0, 1000))
def test_a_push_is_recognised_in_a_noisy_load_and_its_end_found(size: float, sign: float, seed: int) -> None:
    phase = np.clip((TIME - 2.5) / 0.5, 0.0, 1.0)
    load = 0.1 + sign * size * np.sin(np.pi * phase) + 2e-3 * np.random.default_rng(seed).normal(size=len(TIME))
    seen = push_seen(TIME, load, 2.0, 0.01)
    assert seen is not None and seen.torque == pytest.approx(size, abs=0.01)
    assert 2.45 < seen.start < 2.65 and 2.85 < seen.end < 3.05


def test_a_quiet_load_shows_no_push() -> None:
    load = 0.1 + 2e-3 * np.random.default_rng(0).normal(size=len(TIME))
    assert push_seen(TIME, load, 2.0, 0.01) is None
