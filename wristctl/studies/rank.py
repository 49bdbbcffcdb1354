"""What a ranking over worlds found, in words, a table and figures: the part of `compare` that names a family."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from wristctl.config.study import Study
from wristctl.report.printed_table import Table

if TYPE_CHECKING:
    from wristctl.comparison.world_ranking import WorldRanking
    from wristctl.control.table import TunedGains
    from wristctl.studies.session import Session
    from wristctl.wrist.kinematics import Inverse


def ranked(session: Session, study: Study, network: Inverse | None, tuned: TunedGains) -> tuple[WorldRanking, Table]:
    """Rank the rows of `compare` on the worlds that it names, write it down, and give the table that is printed."""
    from wristctl.comparison.world_ranking import RANKED, rank, ranking_frame, worlds_frame
    from wristctl.report.ranking_figures import ranking_intervals, world_profiles
    from wristctl.simulation.drawn_worlds import streams_of
    from wristctl.simulation.metrics import METRICS

    findings, worlds = session.findings, study.compare.worlds
    with session.progress("ranking", total=100, unit="%") as done:
        found = rank(study, tuned, network, lambda share: done(round(100 * share)))
    if worlds.sealed is None:
        findings.note_streams(streams_of(study.families[worlds.family], worlds.family, worlds.split))
    findings.summary(f"**{answer(found)}**\n\n![ranking](figures/ranking.png)")
    units = {name: METRICS[name].unit or "1" for name in RANKED} | {f"rmse_{end}": "rad" for end in ("low", "high")}
    findings.table("data/ranking.csv", ranking_frame(found), units=units | {"worst_rmse": "rad"})
    findings.table("data/worlds.csv", worlds_frame(found), units=units)
    for row, mean in zip(found.rows, found.means, strict=True):
        interval = (mean.low, mean.high) if math.isfinite(mean.high) else None
        findings.metric(f"rmse_{row.label}", mean.value, "rad", "lower", found.worlds, interval)
    with session.progress("drawing"):
        findings.figure("ranking", ranking_intervals, found)
        findings.figure("profiles", world_profiles, found)
    return found, _table(found)


def answer(found: WorldRanking) -> str:
    """Who is best, by how much, what cannot be told, and who fails; in words."""
    stands = found.standing
    said = f"On {found.name}"
    if not stands.groups:
        return f"{said} nothing can be relied on: every row fails or swings in some of {found.worlds} worlds."
    best = stands.groups[0].rows
    gain, mean = found.gains[best[0]], found.means[best[0]]
    names = ", ".join(found.rows[at].label for at in best)
    tie = "" if len(best) == 1 else " (a tie)"
    said += f" {names}{tie} {'is' if len(best) == 1 else 'are'} best: RMSE {_deg(mean.value)} deg, "
    said += f"{gain.value:.3g} times less than feedforward's [{gain.low:.3g} to {gain.high:.3g}]."
    if len(stands.groups) > 1:
        after = stands.groups[1].rows[0]
        said += f" Next is {found.rows[after].label} with {_deg(found.means[after].value)} deg."
    if len(found.rows) > 1 and math.isfinite(stands.floor):
        said += f" Differences below {100.0 * (stands.floor - 1.0):.2g} % cannot be told in {found.worlds} worlds."
    if stands.unreliable:
        fates = (_fate(found, at) for at in stands.unreliable)
        said += f" Not to be relied on: {', '.join(fates)}."
    return said


def _fate(found: WorldRanking, at: int) -> str:
    failures, swings = found.standing.failures[at], found.standing.swings[at]
    told = [f"fails in {failures.times}"] * bool(failures.times) + [f"swings in {swings.times}"] * bool(swings.times)
    return f"{found.rows[at].label} ({' and '.join(told)} of {found.worlds})"


def _deg(value: float) -> str:
    return f"{math.degrees(value):.2g}"


def _table(found: WorldRanking) -> Table:
    rows = []
    for at in found.order:
        mean, gain, group = found.means[at], found.gains[at], found.group(at)
        failures, swings = found.standing.failures[at], found.standing.swings[at]
        interval = tuple(math.degrees(each) for each in (mean.value, mean.low, mean.high))
        times = (gain.value, f"{gain.low:.3g} to {gain.high:.3g}")
        lost = (f"{failures.times} (< {100 * failures.high:.0f} %)", f"{swings.times} (< {100 * swings.high:.0f} %)")
        worst = math.degrees(float(found.rows[at].rmse.max()))
        rows.append(("-" if group is None else str(group), found.rows[at].label, *interval, *times, worst, *lost))
    heads = ("group", "row", "RMSE [deg]", "95 % low", "high", "times better", "95 %", "worst [deg]", "fails", "swings")
    motions = len(found.family.references)
    return Table(f"{answer(found)} {found.worlds} worlds, {motions} motions each", heads, rows)
