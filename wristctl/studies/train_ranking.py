"""What several seeds, rows and depths say, in tables and metrics: T1, C11, C15 and C16."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wristctl.config.learning import TrainSettings
from wristctl.report.printed_table import Table
from wristctl.studies.findings import Findings

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.learning.evaluation import Place
    from wristctl.learning.selection import Choice
    from wristctl.learning.training_result import TrainingResult


def trials_frame(trials: dict[str, list[TrainingResult]], where: list[Place]) -> pd.DataFrame:
    """A row for each training of each network: every measure that these data have."""
    import pandas as pd

    from wristctl.learning.evaluation import measures

    records = [
        {"row": name, "trial": trial.job.trial} | measures(trial, where)
        for name, each in trials.items()
        for trial in each
    ]
    return pd.DataFrame(records).dropna(axis="columns", how="all")


def ranking_tables(
    findings: Findings, settings: TrainSettings, trials: dict[str, list[TrainingResult]], table: pd.DataFrame
) -> list[Table]:
    """Mean and 95 % interval of every measure over the seeds of each network, and what ranking they support."""
    from wristctl.comparison.statistics import spread
    from wristctl.learning.evaluation import MEASURES
    from wristctl.learning.ranking import mean_interval, trained_alike

    meaning = {name: text for name, (_, text) in MEASURES.items()}
    findings.table("data/trials.csv", table, {name: unit for name, (unit, _) in MEASURES.items()}, meaning)
    if len(table) < 2:
        return []
    shown, count = [name for name in MEASURES if name in table], settings.seeds
    rows = []
    for name, own in table.groupby("row", sort=False):
        for measure in shown:
            mean, low, high = mean_interval(own[measure].to_numpy())
            unit, text = MEASURES[measure]
            says = f"{name}: {text}; mean over the seeds with its 95 % interval"
            ends = (low, high) if len(own) > 1 else None
            findings.metric(f"{name}_mean_{measure}", mean, unit, n=len(own), interval=ends, meaning=says)
            middle = spread(own[measure].to_numpy())
            says = f"{name}: {text}; median over the seeds with its 95 % interval by order statistics"
            findings.metric(f"{name}_median_{measure}", middle.median, unit, "", middle.n, middle.interval, says)
            rows.append((name, measure, unit, mean, low, high, middle.median, _printed(settings, str(name), measure)))
    heads = ("network", "measure", "unit", "mean", "95 % low", "95 % high", "median", "paper's T1")
    title = f"Over {count} seed{'s' * (count > 1)} (initial weights and order of samples; one split)"
    tables = [Table(title, heads, rows)]
    complete = min(len(each) for each in trials.values()) == count
    if count < 2 or not complete:
        return tables
    alike = trained_alike({name: each[0].job.settings for name, each in trials.items()})
    return tables + [_ranked(findings, settings, table, label, names) for label, names in alike.items()]


def depth_table(findings: Findings, choice: Choice) -> Table:
    """C15: the error of each depth for each activation, and whether three layers are better than others."""
    import numpy as np

    from wristctl.learning.depths import THREE, compare_depths

    rows = []
    for compared in compare_depths(choice.found):
        activation = compared.activation
        for each in compared.depths:
            depth, folds, rmse = each.best.depth, len(each.best.rmse), float(np.degrees(each.best.mean))
            rows.append((activation, depth, each.best.multiply_adds, rmse, each.p, each.than_three))
            says = f"C15: cross-validated RMSE of {depth} hidden layers, {activation}"
            findings.metric(f"c15_{activation}_depth_{depth}_rmse_deg", rmse, "deg", "lower", folds, meaning=says)
            if depth != THREE:
                says = "C15: paired t-test over the folds against three layers, Holm's correction"
                findings.metric(f"c15_{activation}_depth_{depth}_p", each.p, "", n=folds, meaning=says)
        if compared.three_is_best is not None:
            says = f"C15: 1 where three layers of {activation} are better than every other depth at the 5 % level"
            folds = len(choice.chosen.rmse)
            findings.metric(f"c15_{activation}_three_is_best", int(compared.three_is_best), n=folds, meaning=says)
    findings.metric("c15_chosen_depth", choice.chosen.depth, meaning="C15: hidden layers of the chosen network")
    findings.metric(
        "c15_best_depth", choice.best.depth, meaning="C15: hidden layers of the least cross-validated error"
    )
    heads = ("activation", "hidden layers", "multiply-adds", "RMSE [deg]", "p against 3", "than 3 layers")
    return Table("Are three hidden layers the best trade-off (C15)?", heads, rows)


def _ranked(findings: Findings, settings: TrainSettings, table: pd.DataFrame, label: str, names: list[str]) -> Table:
    """C16: the order of the rows by their error on the test samples, and which differences the seeds support."""
    from wristctl.learning.ranking import LEVEL, rank

    count = settings.seeds
    found = rank({name: table.loc[table["row"] == name, "rmse_deg"].to_numpy() for name in names})
    for place, name in enumerate(found.order, start=1):
        findings.metric(f"{name}_rank_{label}", place, n=count, meaning=f"place by mean RMSE among {label}")
    says = f"Friedman's test that all of {label} are alike"
    findings.metric(f"friedman_p_{label}", found.friedman_p, n=count, meaning=says)
    rows = []
    for pair in found.pairs:
        rows.append((pair.better, pair.worse, pair.difference, pair.p, pair.p < LEVEL))
        says = "RMSE: Wilcoxon's signed-rank test over the seeds, Holm's correction"
        findings.metric(f"p_{pair.better}_before_{pair.worse}", pair.p, n=count, meaning=says)
    rows_by_name = {row.name: row for row in settings.rows}
    for name in (name for name in names if rows_by_name[name].activation == "sigmoid"):
        says = f"C16: 1 where sigmoid's RMSE is below every other's of {label} at the 5 % level"
        findings.metric(f"c16_{name}_is_best", int(found.supports_best(name)), n=count, meaning=says)
        says = f"C16: 1 where some other's RMSE of {label} is below sigmoid's at the 5 % level"
        findings.metric(f"c16_{name}_is_beaten", int(found.supports_better(name)), n=count, meaning=says)
    heads = ("better", "worse", "median difference of RMSE [deg]", "p", "supported")
    title = f"Ranking of {label}: {' < '.join(found.order)} by mean RMSE; Friedman p = {found.friedman_p:.2g}"
    return Table(title, heads, rows)


def _printed(settings: TrainSettings, name: str, measure: str) -> float | None:
    """T1's cell for a row with one of its presets."""
    from wristctl.comparison.paper import T1

    row = next((row for row in settings.rows if row.name == name), settings)
    column = T1.get((row.preset or "").removeprefix("t1-"))
    return getattr(column, measure, None) if column else None
