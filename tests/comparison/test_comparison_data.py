"""Tables and courses of hand-made rows: which number stands where."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from wristctl.arrays import Array
from wristctl.commands.compare.csv_data import frame, metrics_of, repetitions_frame, series
from wristctl.comparison.combinations import ComparedRow
from wristctl.comparison.paper import T2
from wristctl.simulation.repetitions import Repeated, Simulation
from wristctl.simulation.trajectory import Trajectory

SAMPLES = 13
THEIRS = {("four", "step 30 deg")}
"""Where the paper's numbers can be meant."""


def course(segments: int) -> Trajectory:
    """Every column has numbers of its own, so that none can be taken for another."""
    count = iter(range(1, 100))

    def column(*shape: int) -> Array:
        return np.array(np.random.default_rng(next(count)).random((SAMPLES, *shape)), np.float64)

    time, angles = 1e-3 * np.arange(SAMPLES, dtype=np.float64), column(segments)
    return Trajectory(
        "", time, column(), angles, column(), column(), column(), column(2), column(2), column(), column(), column(2)
    )


def row(name: str, metrics: dict[str, list[float]], failed: list[bool], segments: int = 1) -> ComparedRow:
    values = {each: np.array(given) for each, given in metrics.items()}
    first = Simulation(course(segments), {each: given[0] for each, given in metrics.items()}, failed[0], 0.5)
    repeated = Repeated(first, values, np.array(failed), np.full(len(failed), 0.5), first.trajectory.error[None])
    return ComparedRow("four", "step 30 deg", "closed-form", name, "printed", repeated)


def once(name: str, rmse: float, settling: float = 1.2, steady: float = 1e-4, failed: bool = False) -> ComparedRow:
    return row(name, {"rmse": [rmse], "settling": [settling], "steady_state": [steady]}, [failed])


def test_courses_hold_every_fifth_sample_under_their_own_names() -> None:
    rows = [row("smc", {"rmse": [1.0]}, [False], 1), row("pid", {"rmse": [1.0]}, [False], 4)]
    found = series(rows)
    for at, each in enumerate(rows):
        own = each.simulation.trajectory.columns()
        for name in set(found) - {"segment_theta"}:
            np.testing.assert_array_equal(found[name][at], own[name][[0, 5, 10]], err_msg=name)
    assert {"theta", "tip_x", "tip_y", "theta_ref", "theta_desired", "tension_plus", "tension_minus"} < set(found)
    assert len(series(rows, every=1)["time"][0]) == SAMPLES


def test_segments_that_a_plant_does_not_have_are_nan() -> None:
    rows = [row("smc", {"rmse": [1.0]}, [False], 2), row("pid", {"rmse": [1.0]}, [False], 4)]
    found = series(rows)["segment_theta"]
    assert found.shape == (2, 3, 4) and found.dtype == np.float32
    for at, segments in enumerate((2, 4)):
        own = rows[at].simulation.trajectory.segment_theta[::5].astype(np.float32)
        np.testing.assert_array_equal(found[at, :, :segments], own)
    assert np.isnan(found[0, :, 2:]).all()


def test_a_row_stands_beside_the_papers_numbers_and_their_verdict() -> None:
    near = T2["smc"]
    table = frame([once("smc", *near), once("pid", 0.5, failed=True), once("feedforward", 0.1)], THEIRS)
    named = ["loop", "reference", "controller", "gains", "inverse"]
    assert list(table[named].iloc[0]) == ["four", "step 30 deg", "smc", "printed", "closed-form"]
    assert table["rmse"].tolist() == [near.rmse, 0.5, 0.1] and table["failed"].tolist() == [False, True, False]
    printed = table[["paper_rmse", "paper_settling", "paper_steady_state"]].to_numpy()
    for at, name in enumerate(("smc", "pid")):
        assert tuple(printed[at]) == T2[name]
    assert np.isnan(printed[2]).all()
    assert table["verdict"].tolist() == ["reproduced", "not reproduced", ""]
    assert "repetitions" not in table and "rmse_low" not in table


def test_repeated_rows_show_the_median_its_interval_and_any_failure() -> None:
    values = [9.0, 1.0, 8.0, 2.0, 7.0, 3.0, 6.0, 4.0, 5.0]
    metrics = {"rmse": values, "settling": values, "steady_state": values}
    repeated = row("smc", metrics, [False] * 8 + [True])
    table = frame([repeated, once("pid", 0.25)], THEIRS)
    assert table["rmse"].tolist() == [5.0, 0.25] and table["repetitions"].tolist() == [9, 1]
    assert table["failed"].tolist() == [True, False]
    assert (table.loc[0, "rmse_low"], table.loc[0, "rmse_high"]) == (2.0, 8.0)
    assert table.loc[1, ["rmse_low", "rmse_high"]].isna().all()
    assert metrics_of(repeated)["rmse"] == 5.0 and metrics_of(once("pid", 0.25))["rmse"] == 0.25


def test_one_rollout_keeps_its_own_numbers_infinite_or_not() -> None:
    assert metrics_of(once("pid", np.inf))["rmse"] == np.inf


def test_every_repetition_has_a_line() -> None:
    metrics = {"rmse": [1.0, 2.0], "settling": [3.0, 4.0]}
    table = repetitions_frame([row("smc", metrics, [False, True]), once("pid", 0.25)])
    assert table["controller"].tolist() == ["smc", "smc", "pid"] and table["repetition"].tolist() == [0, 1, 0]
    assert table["failed"].tolist() == [False, True, False]
    assert table["rmse"].tolist() == [1.0, 2.0, 0.25] and table["settling"].tolist() == pytest.approx([3.0, 4.0, 1.2])


def test_the_papers_numbers_stand_nowhere_but_where_they_can_be_meant() -> None:
    theirs, elsewhere = (frame([once("smc", *T2["smc"])], cells) for cells in (THEIRS, {("four", "sine 1 Hz 30 deg")}))
    assert theirs["verdict"].tolist() == ["reproduced"] and elsewhere["verdict"].tolist() == [""]
    assert elsewhere[["paper_rmse", "paper_settling", "paper_steady_state"]].isna().all(axis=None)


def test_courses_of_loops_sampled_at_different_rates_share_their_instants() -> None:
    """One at 1 ms, one at 5: of the faster every fifth is kept, of the slower every one."""
    fast, slow = (row("smc", {"rmse": [1.0]}, [False], 1) for _ in range(2))
    late = replace(slow.simulation.trajectory, time=np.arange(SAMPLES) / 200.0)
    longer = replace(fast.simulation.trajectory, time=np.arange(SAMPLES) / 1000.0)
    both = [replace(fast, repeated=Repeated.once(replace(fast.simulation, trajectory=longer))),
            replace(slow, repeated=Repeated.once(replace(slow.simulation, trajectory=late)))]  # fmt: skip
    found = series(both)
    np.testing.assert_allclose(found["time"], [[0.0, 0.005, 0.010]] * 2)
    np.testing.assert_array_equal(found["theta"][1], late.theta[:3])
    np.testing.assert_array_equal(found["theta"][0], longer.theta[[0, 5, 10]])
