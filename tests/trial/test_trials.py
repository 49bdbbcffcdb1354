"""Which trials, in what order, and what their record shows of a push."""

from __future__ import annotations

from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.trial.conftest import settings_of
from wristctl.trial.trial_results import PushSeen, push_seen, recovery
from wristctl.trial.trials import Trial, motions_of, trials_of

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


def test_trials_are_all_combinations_of_direction_repetition_push_and_row() -> None:
    row = {"controller": "feedforward", "gains": "default"}
    settings = settings_of(directions=("ulnar", "flexion"), repetitions=2, push={"force": 2.0}, rows=(row, row, row))
    trials = trials_of(settings, np.random.default_rng(0))
    assert {trial[1:] for trial in trials} == set(product(("ulnar", "flexion"), (0, 1), (0.0, 2.0), (0, 1, 2)))
    only = settings_of(directions=("ulnar", "ulnar"), push={"force": 2.0}, without_push=False)
    assert [trial[1:] for trial in trials_of(only, np.random.default_rng(0))] == [("ulnar", 0, 2.0, 0)]
    assert [trial.push for trial in trials_of(settings_of(), np.random.default_rng(0))] == [0.0]


def test_a_rig_in_two_planes_goes_toward_its_directions_unless_its_reference_is_a_path() -> None:
    toward = ("ulnar", "flexion", "radial-flexion")
    moves = settings_of(planes=2, directions=(*toward, "ulnar"), repetitions=2)
    trials = trials_of(moves, np.random.default_rng(0))
    assert motions_of(moves) == list(toward)
    assert {trial[1:] for trial in trials} == set(product(toward, (0, 1), (0.0,), (0,)))
    circling = {"kind": "circumduction", "angle_deg": 8.0}
    path = settings_of(planes=2, reference=circling, directions=("ulnar",), repetitions=2)
    assert motions_of(path) == ["circumduction"] and motions_of(settings_of(directions=("radial",) * 2)) == ["radial"]
    assert {trial[1:3] for trial in trials_of(path, np.random.default_rng(0))} == {("circumduction", k) for k in (0, 1)}


def test_each_plane_may_come_first() -> None:
    settings = settings_of(directions=("ulnar", "flexion"))
    assert {trials_of(settings, np.random.default_rng(seed))[0].plane for seed in range(20)} == {"ulnar", "flexion"}


def test_a_trial_tells_its_plane_and_what_its_noise_goes_by() -> None:
    pushed, again = Trial(3, "radial", 1, 2.5, 0), Trial(9, "radial", 4, 2.5, 1)
    assert pushed.scenario == again.scenario == "radial, push 2.5 N"
    assert pushed.plane == "ulnar" and Trial(0, "extension", 0, 0.0, 0).plane == "flexion"


LOAD = 0.3 + 0.1 * np.array([5, 0, 0, 0, 0, 0, 0.1, 0.2, 0.4, 1.0, 0.5, 0.3, 0.2, 0.6, 0.0, 0.0])
STEPS = np.arange(16, dtype=np.float64) * 0.1


def test_a_push_lasts_as_long_as_it_is_a_quarter_of_its_largest() -> None:
    """The course before is of the half second before it may begin: the first sample is not of it."""
    assert push_seen(STEPS, LOAD, 0.55, 0.01) == pytest.approx(PushSeen(0.8, 1.2, 0.1))
    assert push_seen(STEPS, 0.6 - LOAD, 0.55, 0.01) == pytest.approx(PushSeen(0.8, 1.2, 0.1))


def test_a_push_is_looked_for_from_when_it_may_begin_and_only_where_it_is_large_enough() -> None:
    assert push_seen(STEPS, LOAD, 0.55, 0.0999) is not None and push_seen(STEPS, LOAD, 0.55, 0.1001) is None
    calm = np.where(STEPS < 1.25, 0.3, LOAD)
    assert push_seen(STEPS, np.where(STEPS < 0.5, 0.9, calm), 1.25, 0.01) == pytest.approx(PushSeen(1.3, 1.4, 0.06))
    assert push_seen(STEPS, LOAD, 0.0, 0.01) is None, "nothing is known of the course before"


def test_a_push_that_goes_on_to_the_end_ends_there_and_one_from_the_beginning_begins_there() -> None:
    assert push_seen(STEPS, 0.1 * STEPS**2, 0.55, 0.01) == pytest.approx(
        PushSeen(0.8, 1.5, 0.1 * (1.5**2 - np.median(STEPS[1:6] ** 2))), abs=0.1001
    )


def test_recovery_counts_to_the_first_instant_after_the_last_large_error() -> None:
    error = np.array([0.5, 0.5, 0.011, 0.0, -0.011, 0.0099, 0.0])
    time = np.arange(7, dtype=np.float64) * 0.1
    assert recovery(time, error, 0.5, 0.2) == pytest.approx(0.3) == recovery(time, error, -0.5, 0.2)
    assert recovery(time, error, 0.5, 0.45) == 0.0
    assert np.isnan(recovery(time, error + 0.1 * (time > 0.55), 0.5, 0.2))
