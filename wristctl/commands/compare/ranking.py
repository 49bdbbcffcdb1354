"""Result of a ranking over worlds in words, a table and figures: the part of `compare` that names a family."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from wristctl.commands.printed_table import Table, degrees, percent
from wristctl.config.study import Study

if TYPE_CHECKING:
    from wristctl.commands.session import Session
    from wristctl.comparison.world_ranking import WorldRanking
    from wristctl.control.table import TunedGains
    from wristctl.wrist.kinematics import Inverse


def ranked(
    session: Session, study: Study, network: Inverse | None, tuned: TunedGains
) -> tuple[list[WorldRanking], list[Table]]:
    """Rank the rows of `compare` on the worlds that it names, write it down, and give the tables that are printed."""
    import pandas as pd

    from wristctl.comparison.world_ranking import RANKED, rank, ranking_frame, worlds_frame
    from wristctl.plotting.ranking_figures import ranking_intervals, world_profiles
    from wristctl.simulation.drawn_worlds import streams_of
    from wristctl.simulation.metrics import METRICS

    findings, worlds = session.findings, study.compare.worlds
    with session.progress("ranking", total=100, unit="%") as report:
        rankings = rank(study, tuned, network, lambda share: report(round(100 * share)))
    if worlds.sealed is None:
        findings.note_streams(streams_of(study.families[worlds.family], worlds.family, worlds.split))
    answers = "\n\n".join(f"**{answer(one_ranking)}**" for one_ranking in rankings)
    findings.summary(f"{answers}\n\n![ranking](figures/ranking.png)")
    units = {name: METRICS[name].unit or "1" for name in RANKED} | {f"rmse_{end}": "rad" for end in ("low", "high")}
    ranking = pd.concat([ranking_frame(one_ranking) for one_ranking in rankings], ignore_index=True)
    findings.table("data/ranking.csv", ranking, units=units | {"worst_rmse": "rad"})
    frames = pd.concat([worlds_frame(one_ranking) for one_ranking in rankings], ignore_index=True)
    findings.table("data/worlds.csv", frames, units=units)
    for index, world_ranking in enumerate(rankings):
        end = "_steps" if index else ""
        for row, mean in zip(world_ranking.rows, world_ranking.means, strict=True):
            interval = (mean.low, mean.high) if math.isfinite(mean.high) else None
            findings.metric(f"rmse_{row.label}{end}", mean.value, "rad", "lower", world_ranking.worlds, interval)
        with session.progress("drawing"):
            findings.figure(f"ranking{end}", ranking_intervals, world_ranking)
            findings.figure(f"profiles{end}", world_profiles, world_ranking)
    return rankings, [_table(one_ranking) for one_ranking in rankings]


def answer(ranking: WorldRanking) -> str:
    """Best rows with their lead, the smallest difference that is told, and the unreliable rows, in words."""
    stands = ranking.standing
    sentence = f"On {ranking.name}"
    if not stands.groups:
        return sentence + _none_ranked(ranking)
    best = stands.groups[0]
    gain, mean = ranking.gains[best[0]], ranking.means[best[0]]
    names = ", ".join(f"{ranking.rows[index].label}{_seldom(ranking, index)}" for index in best)
    tie = "" if len(best) == 1 else " (a tie)"
    sentence += f" {names}{tie} {'is' if len(best) == 1 else 'are'} best: RMSE {degrees(mean.value)} deg, "
    sentence += f"{gain.value:.3g} times less than feedforward's [{gain.low:.3g} to {gain.high:.3g}]."
    if len(stands.groups) > 1:
        after = stands.groups[1][0]
        rmse = degrees(ranking.means[after].value)
        sentence += f" Next is {ranking.rows[after].label}{_seldom(ranking, after)} with {rmse} deg."
    if len(ranking.rows) > 1 and math.isfinite(stands.floor):
        sentence += (
            f" As a rule differences of {100.0 * (stands.floor - 1.0):.2g} % are told in {ranking.worlds} worlds."
        )
    return sentence + _unreliable(ranking)


def _none_ranked(ranking: WorldRanking) -> str:
    from wristctl.comparison.model_confidence_set import LEAST_PAIRS

    if untold := ranking.standing.untold:
        names = ", ".join(ranking.rows[index].label for index in untold)
        return (
            f" {ranking.worlds} worlds are too few to tell {names} apart: {LEAST_PAIRS} or more.{_unreliable(ranking)}"
        )
    return f" nothing can be relied on: every row fails, swings or chatters in some of {ranking.worlds} worlds."


def _unreliable(ranking: WorldRanking) -> str:
    fates = [
        f"{ranking.rows[index].label} ({_fate(ranking, index)} of {ranking.worlds})"
        for index in ranking.standing.unreliable
    ]
    return f" Not to be relied on: {', '.join(fates)}." if fates else ""


def _fate(ranking: WorldRanking, index: int) -> str:
    failures, swings = ranking.standing.failures[index], ranking.standing.swings[index]
    counts = {"fails": failures.times, "swings or chatters": swings.times}
    return " and ".join(f"{wording} in {times}" for wording, times in counts.items() if times)


def _seldom(ranking: WorldRanking, index: int) -> str:
    """Share of the worlds in which a ranked row fails, swings or chatters, in words; empty where it never does."""
    lost = ranking.standing.lost[index]
    return f" ({_fate(ranking, index)}: {percent(lost)})" if lost.times else ""


def _table(ranking: WorldRanking) -> Table:
    rows = []
    for index in ranking.standing.order:
        mean, gain, group = ranking.means[index], ranking.gains[index], ranking.standing.group(index)
        failures, swings = ranking.standing.failures[index], ranking.standing.swings[index]
        ends = tuple(degrees(end) for end in (mean.value, mean.low, mean.high))
        times = (gain.value, f"{gain.low:.3g} to {gain.high:.3g}")
        lost = (f"{failures.times} (< {100 * failures.high:.0f} %)", f"{swings.times} (< {100 * swings.high:.0f} %)")
        worst = math.degrees(float(ranking.rows[index].rmse.max()))
        rows.append(("-" if group is None else str(group), ranking.rows[index].label, *ends, *times, worst, *lost))
    heads = ("group", "row", "RMSE [deg]", "95 % low", "high", "times better", "95 %", "worst [deg]", "fails", "swings")
    return Table(f"{answer(ranking)} {ranking.worlds} worlds, {ranking.motions} motions each", heads, rows)
