"""What a ranking over worlds found, in words, a table and figures: the part of `compare` that names a family."""

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
    with session.progress("ranking", total=100, unit="%") as done:
        rankings = rank(study, tuned, network, lambda share: done(round(100 * share)))
    if worlds.sealed is None:
        findings.note_streams(streams_of(study.families[worlds.family], worlds.family, worlds.split))
    answers = "\n\n".join(f"**{answer(found)}**" for found in rankings)
    findings.summary(f"{answers}\n\n![ranking](figures/ranking.png)")
    units = {name: METRICS[name].unit or "1" for name in RANKED} | {f"rmse_{end}": "rad" for end in ("low", "high")}
    ranking = pd.concat([ranking_frame(found) for found in rankings], ignore_index=True)
    findings.table("data/ranking.csv", ranking, units=units | {"worst_rmse": "rad"})
    frames = pd.concat([worlds_frame(found) for found in rankings], ignore_index=True)
    findings.table("data/worlds.csv", frames, units=units)
    for at, found in enumerate(rankings):
        end = "_steps" if at else ""
        for row, mean in zip(found.rows, found.means, strict=True):
            interval = (mean.low, mean.high) if math.isfinite(mean.high) else None
            findings.metric(f"rmse_{row.label}{end}", mean.value, "rad", "lower", found.worlds, interval)
        with session.progress("drawing"):
            findings.figure(f"ranking{end}", ranking_intervals, found)
            findings.figure(f"profiles{end}", world_profiles, found)
    return rankings, [_table(found) for found in rankings]


def answer(found: WorldRanking) -> str:
    """Who is best, by how much, what cannot be told, and who fails; in words."""
    stands = found.standing
    said = f"On {found.name}"
    if not stands.groups:
        return said + _none_ranked(found)
    best = stands.groups[0]
    gain, mean = found.gains[best[0]], found.means[best[0]]
    names = ", ".join(f"{found.rows[at].label}{_seldom(found, at)}" for at in best)
    tie = "" if len(best) == 1 else " (a tie)"
    said += f" {names}{tie} {'is' if len(best) == 1 else 'are'} best: RMSE {degrees(mean.value)} deg, "
    said += f"{gain.value:.3g} times less than feedforward's [{gain.low:.3g} to {gain.high:.3g}]."
    if len(stands.groups) > 1:
        after = stands.groups[1][0]
        said += (
            f" Next is {found.rows[after].label}{_seldom(found, after)} with {degrees(found.means[after].value)} deg."
        )
    if len(found.rows) > 1 and math.isfinite(stands.floor):
        said += f" As a rule differences of {100.0 * (stands.floor - 1.0):.2g} % are told in {found.worlds} worlds."
    return said + _unreliable(found)


def _none_ranked(found: WorldRanking) -> str:
    from wristctl.comparison.model_confidence_set import LEAST_PAIRS

    if untold := found.standing.untold:
        names = ", ".join(found.rows[at].label for at in untold)
        return f" {found.worlds} worlds are too few to tell {names} apart: {LEAST_PAIRS} or more.{_unreliable(found)}"
    return f" nothing can be relied on: every row fails, swings or chatters in some of {found.worlds} worlds."


def _unreliable(found: WorldRanking) -> str:
    fates = [f"{found.rows[at].label} ({_fate(found, at)} of {found.worlds})" for at in found.standing.unreliable]
    return f" Not to be relied on: {', '.join(fates)}." if fates else ""


def _fate(found: WorldRanking, at: int) -> str:
    failures, swings = found.standing.failures[at], found.standing.swings[at]
    counts = {"fails": failures.times, "swings or chatters": swings.times}
    return " and ".join(f"{what} in {times}" for what, times in counts.items() if times)


def _seldom(found: WorldRanking, at: int) -> str:
    """How often a row fails, swings or chatters that is not shown to do so too often; empty where it never does."""
    lost = found.standing.lost[at]
    return f" ({_fate(found, at)}: {percent(lost)})" if lost.times else ""


def _table(found: WorldRanking) -> Table:
    rows = []
    for at in found.standing.order:
        mean, gain, group = found.means[at], found.gains[at], found.standing.group(at)
        failures, swings = found.standing.failures[at], found.standing.swings[at]
        ends = tuple(degrees(each) for each in (mean.value, mean.low, mean.high))
        times = (gain.value, f"{gain.low:.3g} to {gain.high:.3g}")
        lost = (f"{failures.times} (< {100 * failures.high:.0f} %)", f"{swings.times} (< {100 * swings.high:.0f} %)")
        worst = math.degrees(float(found.rows[at].rmse.max()))
        rows.append(("-" if group is None else str(group), found.rows[at].label, *ends, *times, worst, *lost))
    heads = ("group", "row", "RMSE [deg]", "95 % low", "high", "times better", "95 %", "worst [deg]", "fails", "swings")
    return Table(f"{answer(found)} {found.worlds} worlds, {found.motions} motions each", heads, rows)
