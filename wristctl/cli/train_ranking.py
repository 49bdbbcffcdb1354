"""What several seeds, rows and depths say, in tables and metrics: T1, C11, C15 and C16."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wristctl.cli.command import Session, Table

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.learning.evaluation import Place
    from wristctl.learning.selection import Choice, CrossValidated
    from wristctl.learning.training_result import TrainingResult


def write_rows(session: Session, trials: dict[str, list[TrainingResult]], where: list[Place]) -> list[Table]:
    """Mean and 95 % interval of every measure over the seeds of each network, and what ranking they support."""
    import pandas as pd

    from wristctl.learning.evaluation import MEASURES, measures
    from wristctl.learning.ranking import mean_interval

    run, count = session.run, session.settings.seeds
    records = [
        {"row": name, "trial": trial.job.trial} | measures(trial, where)
        for name, each in trials.items()
        for trial in each
    ]
    table = pd.DataFrame(records).dropna(axis="columns", how="all")
    meaning = {name: text for name, (_, text) in MEASURES.items()}
    run.table("data/trials.csv", table, {name: unit for name, (unit, _) in MEASURES.items()}, meaning)
    if len(table) < 2:
        return []
    shown = [name for name in MEASURES if name in table]
    rows = []
    for name, own in table.groupby("row", sort=False):
        for measure in shown:
            mean, low, high = mean_interval(own[measure].to_numpy())
            unit, text = MEASURES[measure]
            said = f"{name}: {text}; mean over the seeds with its 95 % interval"
            ends = (low, high) if len(own) > 1 else None
            run.metric(f"{name}_mean_{measure}", mean, unit, n=len(own), interval=ends, meaning=said)
            middle = float(own[measure].median())
            run.metric(f"{name}_median_{measure}", middle, unit, n=len(own), meaning=f"{name}: {text}; median")
            rows.append((name, measure, unit, mean, low, high, middle, _printed(session, str(name), measure)))
    heads = ("network", "measure", "unit", "mean", "95 % low", "95 % high", "median", "paper's T1")
    title = f"Over {count} seed{'s' * (count > 1)} (initial weights and order of samples; one split)"
    tables = [Table(title, heads, rows)]
    if count < 2:
        return tables
    return tables + [
        made for label, names in _groups(session, trials).items() for made in _ranked(session, table, label, names)
    ]


def write_depths(session: Session, choice: Choice) -> list[Table]:
    """C15: the error of each depth for each activation, and whether three layers are better than others."""
    import numpy as np
    from scipy.stats import ttest_rel

    from wristctl.learning.ranking import LEVEL, holm

    run, rows = session.run, []
    for activation in dict.fromkeys(each.settings.activation for each in choice.found):
        least: dict[int, CrossValidated] = {}
        for each in (each for each in choice.found if each.settings.activation == activation):
            if each.depth not in least or each.mean < least[each.depth].mean:
                least[each.depth] = each
        three, others = least.get(3), [depth for depth in least if depth != 3]
        p = [
            float(ttest_rel(least[depth].rmse, three.rmse).pvalue)
            if three and np.isfinite([least[depth].mean, three.mean]).all()
            else np.nan
            for depth in others
        ]
        corrected = dict(zip(others, holm(p), strict=True)) if three else {}
        for depth, each in sorted(least.items()):
            rmse = float(np.degrees(each.mean))
            beside = corrected.get(depth, np.nan)
            word = "" if depth == 3 or not three else "better" if each.mean < three.mean else "worse"
            if word and not beside < LEVEL:
                word = "no difference shown"
            rows.append((activation, depth, each.multiply_adds, rmse, beside, word))
            said = f"C15: cross-validated RMSE of {depth} hidden layers, {activation}"
            run.metric(f"c15_{activation}_depth_{depth}_rmse_deg", rmse, "deg", "lower", len(each.rmse), meaning=said)
            if depth != 3:
                said = "C15: paired t-test over the folds against three layers, Holm's correction"
                run.metric(f"c15_{activation}_depth_{depth}_p", beside, "", n=len(each.rmse), meaning=said)
        if three:
            said = f"C15: 1 where three layers of {activation} are better than every other depth at the 5 % level"
            best = all(least[depth].mean > three.mean and corrected[depth] < LEVEL for depth in others)
            run.metric(f"c15_{activation}_three_is_best", int(best), n=len(three.rmse), meaning=said)
    run.metric("c15_chosen_depth", choice.chosen.depth, meaning="C15: hidden layers of the chosen network")
    run.metric("c15_best_depth", choice.best.depth, meaning="C15: hidden layers of the least cross-validated error")
    heads = ("activation", "hidden layers", "multiply-adds", "RMSE [deg]", "p against 3", "than 3 layers")
    return [Table("Are three hidden layers the best trade-off (C15)?", heads, rows)]


def _groups(session: Session, trials: dict[str, list[TrainingResult]]) -> dict[str, list[str]]:
    """Names of networks that were trained the same way, which alone can be ranked."""
    groups: dict[str, list[str]] = {}
    for name, each in trials.items():
        settings = each[0].job.settings
        label = f"{settings.optimiser}-{'standardised' if settings.standardise else 'raw'}"
        groups.setdefault(label, []).append(name)
    complete = min(len(each) for each in trials.values()) == session.settings.seeds
    return {label: names for label, names in groups.items() if len(names) > 1} if complete else {}


def _ranked(session: Session, table: pd.DataFrame, label: str, names: list[str]) -> list[Table]:
    """C16: the order of the rows by their error on the test samples, and which differences the seeds support."""
    from wristctl.learning.ranking import LEVEL, rank

    run, count = session.run, session.settings.seeds
    rmse = {name: table.loc[table["row"] == name, "rmse_deg"].to_numpy() for name in names}
    found = rank(rmse)
    for place, name in enumerate(found.order, start=1):
        run.metric(f"{name}_rank_{label}", place, n=count, meaning=f"place by mean RMSE among {label}")
    said = f"Friedman's test that all of {label} are alike"
    run.metric(f"friedman_p_{label}", found.friedman_p, n=count, meaning=said)
    rows = []
    for pair in found.pairs:
        rows.append((pair.better, pair.worse, pair.difference, pair.p, pair.p < LEVEL))
        said = "RMSE: Wilcoxon's signed-rank test over the seeds, Holm's correction"
        run.metric(f"p_{pair.better}_before_{pair.worse}", pair.p, n=count, meaning=said)
    settings = {row.name: row for row in session.settings.rows}
    for name in (name for name in names if settings[name].activation == "sigmoid"):
        said = f"C16: 1 where sigmoid's RMSE is below every other's of {label} at the 5 % level"
        run.metric(f"c16_{name}_is_best", int(found.supports_best(name)), n=count, meaning=said)
    heads = ("better", "worse", "median difference of RMSE [deg]", "p", "supported")
    title = f"Ranking of {label}: {' < '.join(found.order)} by mean RMSE; Friedman p = {found.friedman_p:.2g}"
    return [Table(title, heads, rows)]


def _printed(session: Session, name: str, measure: str) -> float | None:
    """T1's cell for a row with one of its presets."""
    from wristctl.comparison.paper import T1

    row = next((row for row in session.settings.rows if row.name == name), session.settings)
    column = T1.get((row.preset or "").removeprefix("t1-"))
    return getattr(column, measure, None) if column else None
