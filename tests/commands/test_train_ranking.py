"""What several seeds, rows and depths of a training say in tables and metrics."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from wristctl.commands.results import Findings
from wristctl.commands.train.results import best_row, depth_table, grid_tables, ranking_tables
from wristctl.comparison.paper import T1
from wristctl.config.learning import NetworkRow, NetworkSettings, TrainSettings
from wristctl.learning.ranking import mean_interval
from wristctl.learning.selection import Choice, CrossValidated

NAMES = ("sig", "tan", "rel")
SEEDS = 8


def settings(**more: Any) -> TrainSettings:
    activations = ("sigmoid", "tanh", "relu")
    rows = tuple(NetworkRow(name=name, activation=kind) for name, kind in zip(NAMES, activations, strict=True))  # type: ignore[arg-type]
    return TrainSettings(rows=rows, seeds=SEEDS, **more)


def trials(given: TrainSettings, count: int = SEEDS) -> dict[str, Any]:
    rows: dict[str, Any] = {row.name: row for row in given.rows} or {"": given}
    return {
        name: [SimpleNamespace(job=SimpleNamespace(settings=row, trial=k), validation_loss=1.0) for k in range(count)]
        for name, row in rows.items()
    }


def table(count: int = SEEDS) -> pd.DataFrame:
    """RMSEs of 1.00, 1.01, 1.04, ... deg for the first network, twice that for the second, four times for the third."""
    rmse = {name: 2.0**at * (1.0 + 0.01 * np.arange(count) ** 2) for at, name in enumerate(NAMES)}
    common = {"trial": range(count), "epochs": 5}
    return pd.concat([pd.DataFrame({"row": name, "rmse_deg": each} | common) for name, each in rmse.items()])


def test_each_network_has_its_mean_with_interval_and_its_median() -> None:
    findings, given = Findings(0), settings()
    means, _ = ranking_tables(findings, given, trials(given), table())
    assert means.title == "Over 8 seeds (initial weights and order of samples; one split)"
    heads = ("network", "measure", "unit", "mean", "95 % low", "95 % high", "median", "paper's T1")
    assert means.columns == heads
    assert [row[:3] for row in means.rows] == [
        pair for name in NAMES for pair in ((name, "rmse_deg", "deg"), (name, "epochs", "1"))
    ]
    expected = mean_interval((2.0 * (1.0 + 0.01 * np.arange(8.0) ** 2)).tolist())
    tan = dict(zip(heads, means.rows[2], strict=True))
    assert (tan["mean"], tan["95 % low"], tan["95 % high"]) == pytest.approx(expected)
    assert tan["median"] == pytest.approx(2.25) and tan["paper's T1"] is None
    mean, median = (findings.metrics[f"tan_{kind}_rmse_deg"] for kind in ("mean", "median"))
    assert (mean["value"], mean["n"], mean["unit"]) == (pytest.approx(expected[0]), 8, "deg")
    assert mean["interval"] == pytest.approx(expected[1:]) and mean["meaning"].startswith("tan: ")
    assert (median["value"], median["unit"]) == (pytest.approx(2.25), "deg")


def test_networks_are_ranked_by_their_error_and_each_pair_is_tested() -> None:
    findings, given = Findings(0), settings()
    _, ranked = ranking_tables(findings, given, trials(given), table())
    assert " sig < tan < rel by mean RMSE" in ranked.title
    assert [row[:2] for row in ranked.rows] == [("sig", "tan"), ("sig", "rel"), ("tan", "rel")]
    assert ranked.columns == ("better", "worse", "median difference of RMSE [deg]", "p", "supported")
    assert ranked.rows[0][2] == pytest.approx(1.125) and all(row[4] is True for row in ranked.rows)
    places = {name: metric["value"] for name, metric in findings.metrics.items() if "_rank_" in name}
    assert [value for _, value in sorted(places.items())] == [3, 1, 2], "rel, sig, tan"
    (best,) = (metric for name, metric in findings.metrics.items() if name == "c16_sig_is_best")
    assert (best["value"], best["n"]) == (1, 8)
    assert not any(name in findings.metrics for name in ("c16_tan_is_best", "c16_rel_is_best"))
    assert findings.metrics["p_sig_before_tan"]["value"] < 0.05
    (friedman,) = (metric for name, metric in findings.metrics.items() if name.startswith("friedman_p"))
    assert friedman["value"] < 0.01 and f"Friedman p = {friedman['value']:.2g}" in ranked.title


def test_where_nothing_is_shown_nothing_is_supported() -> None:
    findings, given = Findings(0), settings()
    alike = table()
    alike["rmse_deg"] = [1.0 + 0.01 * ((3 * at + k) % 8) for at in range(3) for k in range(8)]
    _, ranked = ranking_tables(findings, given, trials(given), alike)
    assert not any(row[4] for row in ranked.rows) and findings.metrics["c16_sig_is_best"]["value"] == 0


def test_one_training_is_no_statistics_and_two_of_a_seed_are_not_ranked() -> None:
    alone = TrainSettings()
    one = pd.DataFrame({"row": [""], "trial": [0], "rmse_deg": [1.0]})
    findings = Findings(0)
    assert ranking_tables(findings, alone, trials(alone, 1), one) == [] and not findings.metrics
    given = settings().model_copy(update={"seeds": 1})
    (means,) = ranking_tables(findings, given, trials(given, 1), table(1))
    assert findings.metrics["tan_mean_rmse_deg"]["interval"] is None
    assert means.title.startswith("Over 1 seed (")


def test_networks_that_were_cut_short_are_not_ranked() -> None:
    given = settings()
    several = trials(given)
    several["rel"] = several["rel"][:5]
    found = ranking_tables(Findings(0), given, several, table())
    assert len(found) == 1


def test_the_papers_cell_stands_beside_a_network_of_its_preset() -> None:
    given = TrainSettings(rows=(NetworkRow(name="one", preset="t1-sigmoid"),), seeds=2)
    two = pd.DataFrame({"row": ["one", "one"], "trial": [0, 1], "train_loss": [0.9, 0.8], "epochs": [5, 5]})
    findings = Findings(0)
    (means,) = ranking_tables(findings, given, trials(given, 1), two)
    assert findings.metrics["one_mean_train_loss"]["interval"] is not None, "of two seeds there is one"
    assert [row[-1] for row in means.rows] == [T1["sigmoid"].train_loss, None]


def point(hidden: tuple[int, ...], rmse_deg: list[float], activation: Any = "tanh") -> CrossValidated:
    kind = NetworkSettings(hidden=hidden, activation=activation, learning_rate=0.01, weight_decay=0.0)
    return CrossValidated(kind, len(hidden), 10 * len(hidden), np.radians(rmse_deg))


def chosen() -> Choice:
    found = [
        point((4,), [4.0, 4.3, 4.1, 4.2]), point((4, 4), [2.0, 2.1, 2.2, 2.4]), point((4, 4, 4), [1.0, 1.1, 1.2, 1.3]),
    ]  # fmt: skip
    return Choice(found, found[1], found[2], "few is enough")


def test_depths_are_held_against_three_layers() -> None:
    findings = Findings(0)
    found = depth_table(findings, chosen())
    assert found.columns[:4] == ("activation", "hidden layers", "multiply-adds", "RMSE [deg]")
    assert [row[:3] for row in found.rows] == [("tanh", 1, 10), ("tanh", 2, 20), ("tanh", 3, 30)]
    assert [row[3] for row in found.rows] == pytest.approx([4.15, 2.175, 1.15])
    assert [row[5] for row in found.rows] == ["worse", "worse", ""]
    values = {name: metric["value"] for name, metric in findings.metrics.items()}
    assert values["c15_tanh_depth_2_rmse_deg"] == pytest.approx(2.175)
    assert findings.metrics["c15_tanh_depth_1_rmse_deg"]["n"] == 4
    assert values["c15_tanh_depth_1_p"] < 0.05 and "c15_tanh_depth_3_p" not in values
    assert (values["c15_tanh_three_is_best"], values["c15_chosen_depth"], values["c15_best_depth"]) == (1, 2, 3)


def test_the_grid_is_shown_with_what_was_chosen_and_why() -> None:
    findings = Findings(0)
    grid, _ = grid_tables(findings, chosen())
    assert grid.title == "Cross-validation: few is enough"
    assert grid.columns[0] == "layers" and [row[0] for row in grid.rows] == ["4", "4-4", "4-4-4"]
    cells = dict(zip(grid.columns, grid.rows[1], strict=True))
    assert (cells["activation"], cells["rate"], cells["decay"], cells["multiply-adds"]) == ("tanh", 0.01, 0.0, 20)
    assert cells["RMSE [deg]"] == pytest.approx(2.175)
    assert cells["standard error [deg]"] == pytest.approx(np.std([2.0, 2.1, 2.2, 2.4], ddof=1) / 2.0)
    marked = findings.figures["accuracy-against-cost"].axes[0].lines[-1]
    assert np.asarray(marked.get_xdata())[0] == 20


def test_the_kept_network_has_the_training_of_least_loss_a_diverged_one_never() -> None:
    def of(*losses: float) -> Any:
        return [SimpleNamespace(validation_loss=loss) for loss in losses]

    assert best_row({"a": of(0.5, 0.4), "b": of(0.9, 0.1), "c": of(0.2)})[0] == "b"
    assert best_row({"a": of(np.nan), "b": of(0.9, np.nan), "c": of(-np.inf)})[0] == "b"
