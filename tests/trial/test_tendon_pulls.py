"""Load cells show what balances: tendons that pull against each other, that do not pull, and cells that are silent."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.trial.conftest import WRIST, Run, settings_of
from wristctl.board.messages import Fault, Flag, Pulls, State
from wristctl.control.response import Estimate
from wristctl.trial.residuals import RESIDUALS, columns, limits_of
from wristctl.trial.safety import SafetyStop
from wristctl.trial.spools import spools_of
from wristctl.trial.tendon_pulls import TendonPulls, tendon_pulls_of
from wristctl.trial.tick_timing import TickTiming
from wristctl.trial.watch import Tick, Watch
from wristctl.wrist.directions import ACTIVE

WEIGHED = [name for name, line in RESIDUALS.items() if line.weighed]
SCALE, OFFSET = (80.0, -90.0, 85.0, 100.0), (10.0, -20.0, 30.0, 400.0)
SETTINGS = settings_of(load_cells={"counts_per_newton": SCALE, "offset": OFFSET})
STIFFEST, SOFTEST = SETTINGS.safety.stiffest, SETTINGS.safety.softest
STEP = spools_of(SETTINGS.actuator).step


def reading(newtons: Sequence[float], age: Sequence[float] = (0.01,) * 4, time: float = 10.0) -> Pulls:
    counts: Any = tuple(
        round(offset + scale * pull) for offset, scale, pull in zip(OFFSET, SCALE, newtons, strict=True)
    )
    ages: Any = tuple(age)
    still = (0, 0, 0, 0)
    return Pulls(time, State.ENABLED, Fault(0), Flag(0), 0.1, still, still, 0, counts, ages)


def pulls_of(newtons: Sequence[float], **more: Any) -> TendonPulls:
    pulls = TendonPulls(SETTINGS)
    pulls.take(reading(newtons, **more))
    return pulls


def test_a_rig_without_load_cells_has_no_pulls_no_limits_and_no_columns_of_them() -> None:
    assert tendon_pulls_of(settings_of()) is None
    assert not {limit.name for limit in limits_of(settings_of())} & set(WEIGHED)
    assert {limit.name for limit in limits_of(SETTINGS)} >= set(WEIGHED)
    assert list(columns(1, True)) == [limit.name for limit in limits_of(SETTINGS)]
    assert list(columns(1, False)) == [name for name in columns(1, True) if name not in WEIGHED]


@given(st.lists(st.floats(0.0, 100.0), min_size=4, max_size=4))
def test_counts_become_newtons_by_each_cells_own_zero_and_scale(newtons: list[float]) -> None:
    assert pulls_of(newtons).pull == pytest.approx(newtons, abs=0.5 / 80.0)


@given(
    stretch=st.lists(st.floats(0.0, 8e-4), min_size=4, max_size=4),
    share=st.lists(st.floats(0.3, 1.0), min_size=4, max_size=4),
)
def test_any_pull_between_those_of_the_softest_and_the_stiffest_tendon_is_sound(
    stretch: list[float], share: list[float]
) -> None:
    softest, stiffest = SOFTEST * np.array(stretch), STIFFEST * np.array(stretch)
    pulls = pulls_of((softest + (stiffest - softest) * np.array(share)).tolist())
    residuals = pulls.residuals(0.0, np.array(stretch))
    assert residuals["excess_pull"] < 0.02 and residuals["missing_pull"] < 0.02


@given(axis=st.integers(0, 3), more=st.floats(1.0, 40.0))
def test_excess_is_what_no_spool_of_the_last_moments_explains(axis: int, more: float) -> None:
    """A reading is older than the spools' positions: what they held while it was taken counts too."""
    pulls, stretch, held = TendonPulls(SETTINGS), np.full(4, 2e-4), STIFFEST * 2e-4
    pulls.take(reading([held + more * (k == axis) for k in range(4)]))
    assert pulls.residuals(0.0, stretch)["excess_pull"] == pytest.approx(more, abs=0.02)
    assert pulls.residuals(0.08, 0.0 * stretch)["excess_pull"] == pytest.approx(more, abs=0.02)
    assert pulls.residuals(0.2, 0.0 * stretch)["excess_pull"] == pytest.approx(held + more, abs=0.02)
    assert f"axis {axis} (tendon {ACTIVE[axis]})" in pulls.causes("excess_pull")


def test_a_tendon_that_shows_less_than_a_quarter_of_what_the_softest_would_is_missing_and_named() -> None:
    stretch, least = np.array([0.0, 6e-4, 6e-4, 1e-4]), SOFTEST * 6e-4
    assert pulls_of((0.0, 0.3 * least, least, 0.0)).residuals(0.0, stretch)["missing_pull"] == pytest.approx(0.5)
    pulls = pulls_of((0.0, 0.2 * least, least, 1.0))
    assert pulls.residuals(0.0, stretch)["missing_pull"] == pytest.approx(least)
    assert "axis 1 (tendon 2) is off its pulley" in pulls.causes("missing_pull")


def test_tendons_that_pull_more_together_pull_against_each_other_and_one_alone_is_caught() -> None:
    together, alone = pulls_of((20.0,) * 4), pulls_of((20.0, 1.0, 1.0, 1.0))
    for pulls in (together, alone):
        pulls.residuals(0.0, np.zeros(4))
    assert "against each other" in together.causes("excess_pull") and "tendon 5" in together.causes("measured_pull")
    assert "tendon of axis 0 (tendon 1) is caught" in alone.causes("excess_pull")


def test_a_silent_cell_is_named_and_counts_as_no_pull_once_amplifiers_have_settled() -> None:
    ages = (0.01, 0.01, 0.255, 0.01)
    starting = pulls_of((1.0,) * 4, age=ages, time=0.9)
    starting.judge()
    pulls = pulls_of((1.0, 2.0, 50.0, 3.0), age=ages)
    assert np.isnan(pulls.pull).tolist() == [False, False, True, False]
    assert pulls.residuals(0.0, np.zeros(4)) | {"excess_pull": 0.0} == {
        "cell_age": 0.255, "measured_pull": pytest.approx(3.0, abs=0.01), "excess_pull": 0.0, "missing_pull": 0.0
    }  # fmt: skip
    with pytest.raises(SafetyStop, match=r"axis 2 \(tendon 4\) is unplugged"):
        pulls.judge()


@pytest.mark.parametrize("end", [32_767, -32_768])
def test_an_amplifier_at_an_end_of_its_range_counts_as_silent(end: int) -> None:
    pulls = TendonPulls(SETTINGS)
    pulls.take(reading((1.0,) * 4)._replace(counts=(0, 0, 0, end)))
    assert math.isnan(pulls.pull[3])
    with pytest.raises(SafetyStop, match="a wire of its cell is broken"):
        pulls.judge()


def test_beside_motors_that_stand_no_tendon_may_pull_more_than_motors_and_tendons_should() -> None:
    most = SETTINGS.safety.motor_pull
    pulls_of((0.0, 0.0, 0.0, most - 0.1)).judge()
    with pytest.raises(SafetyStop, match=f"{most + 1:.0f} N by its load cell, beyond {most:.0f} N") as stopped:
        pulls_of((0.0, 0.0, 0.0, most + 1.0)).judge()
    assert stopped.value.exit_code == 5 and stopped.value.fix


def watching(newtons: Sequence[float]) -> Watch:
    return Watch(SETTINGS, WRIST, "ulnar", TickTiming(0.01), 0.0, pulls_of(newtons))


def test_a_loop_is_stopped_by_pulls_that_last_and_says_which_tendons() -> None:
    watch, still = watching((20.0,) * 4), np.full(4, 1e-4 / STEP)
    with pytest.raises(SafetyStop, match="pulls 15 N more than its spool explains, beyond 10 N") as stopped:
        for tick in range(20):
            at = Tick(0.01 * tick, 0.0, Estimate(0.0, 0.0, 0.0), still, np.zeros(4), State.ENABLED, 0, 0)
            watch.see(at, at.clock)
            watch.judge(at)
    assert at.clock == pytest.approx(SETTINGS.safety.odd_for * 10.0 / 15.0, abs=0.011)
    assert "against each other" in stopped.value.what and "tendon 5" in stopped.value.what
    assert stopped.value.fix.startswith("cut the motors' supply"), "no cause is said twice"


def test_a_standing_wrist_is_judged_by_its_load_cells_too() -> None:
    still = np.zeros(4)
    watching((9.0,) * 4).standing(np.zeros(1), still, still, 0.0)
    with pytest.raises(SafetyStop, match=r"11 N more than its spool explains.*against each other") as stopped:
        watching((11.0,) * 4).standing(np.zeros(1), still, still, 0.0)
    assert stopped.value.fix.startswith("cut the motors' supply"), "no cause is said twice"
    with pytest.raises(SafetyStop, match=r"a load cell for .*the amplifier of axis 2") as silent:
        Watch(SETTINGS, WRIST, "ulnar", TickTiming(0.01), 0.0, pulls_of((1.0,) * 4, age=(0.0, 0.0, 9.0, 0.0))).standing(
            np.zeros(1), still, still, 0.0
        )
    assert "see its plugs" in silent.value.fix


WITH_CELLS: dict[str, Any] = {"load_cells": {}, "horizon": 0.6}


def faulty(faults: Sequence[dict[str, Any]], cells: bool = True) -> dict[str, Any]:
    bench = settings_of().bench.model_dump() | {"load_cells": {} if cells else None, "faults": tuple(faults)}
    return (WITH_CELLS if cells else {"horizon": 0.6}) | {"bench": bench}


AGAINST = [{"kind": "tendon-slipped", "axis": axis, "size": -1.0, "at": 0.1} for axis in range(4)]


@pytest.mark.slow
def test_a_sound_rig_goes_through_and_its_log_has_the_true_pulls(experiment: Run) -> None:
    done = experiment(**faulty(()))
    assert done.error is None and done.experiment.outcomes == {0: "ok"} and done.experiment.odd == {0: ""}
    log, truth, residuals = done.table("log"), done.table("truth"), done.table("residuals")
    for tendon in ACTIVE:
        true = np.interp(log["time"] - 0.04, truth["time"], truth[f"pull_{tendon}"])
        later = log["time"] > 0.1
        assert np.abs(log[f"pull_{tendon}"] - true)[later].max() < 3.0  # cells that nobody has weighed
    assert residuals["cell_age"].max() < 0.03 and residuals["excess_pull"].max() < 5.0


@pytest.mark.slow
def test_tendons_that_all_pull_20_newtons_more_end_a_trial_that_goes_through_without_load_cells(
    experiment: Run,
) -> None:
    blind = experiment(**faulty(AGAINST, cells=False))
    assert blind.experiment.odd == {0: ""}
    assert blind.experiment.outcomes[0].startswith("after it: tendons pull against each other")
    done = experiment(**faulty(AGAINST))
    assert isinstance(done.error, SafetyStop) and "tendons pull against each other" in done.error.what
    assert done.experiment.stop is not None and done.experiment.stop.time is not None
    assert done.experiment.stop.time < 0.1 + 0.13
    assert done.bench.truth().pull.max() < 36.0


@pytest.mark.slow
def test_an_amplifier_that_dies_ends_the_trial_and_is_named(experiment: Run) -> None:
    done = experiment(**faulty([{"kind": "cell-unplugged", "axis": 1, "at": 0.1}]))
    assert isinstance(done.error, SafetyStop)
    assert "no reading of a load cell" in done.error.what and "axis 1 (tendon 2)" in done.error.what


def test_a_rig_whose_load_cells_are_not_wired_does_not_begin(experiment: Run) -> None:
    done = experiment(load_cells={}, bench=settings_of().bench.model_dump() | {"person": {"takes": 2.0}})
    assert isinstance(done.error, SafetyStop) and "no reading of a load cell" in done.error.what
    assert not any(done.bench.motion().energised) and done.experiment.outcomes == {}
