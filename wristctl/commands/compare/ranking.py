"""Files and figures of a ranking over worlds: the part of `compare` that names a family."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wristctl.commands.ranking_tables import draw_intervals, keep_error
from wristctl.commands.step_times import after_rollouts
from wristctl.config.study import Study

if TYPE_CHECKING:
    from wristctl.commands.session import Session
    from wristctl.comparison.world_ranking import WorldRanking
    from wristctl.control.table import TunedGains
    from wristctl.wrist.kinematics import Inverse


def ranked(session: Session, study: Study, network: Inverse | None, tuned: TunedGains) -> list[WorldRanking]:
    """Rank the rows of `compare` on the worlds that it names, and write down rankings and worlds."""
    import pandas as pd

    from wristctl.comparison.world_ranking import rank, ranked_units, ranking_frame, worlds_frame
    from wristctl.simulation.drawn_worlds import streams_of

    findings, worlds = session.findings, study.compare.worlds
    with session.progress("ranking", 100, "%", after=after_rollouts(len(study.compare.rows))) as report:
        rankings = rank(study, tuned, network, lambda share: report(round(100 * share)))
    if worlds.sealed is None:
        findings.note_streams(streams_of(study.families[worlds.family], worlds.family, worlds.split))
    frames = pd.concat([worlds_frame(one_ranking) for one_ranking in rankings], ignore_index=True)
    findings.table("data/worlds.csv", frames, units=ranked_units())
    for index, world_ranking in enumerate(rankings):
        end = "_steps" if index else ""
        findings.table(f"data/ranking{end.replace('_', '-')}.csv", ranking_frame(world_ranking), units=ranked_units())
        for row, label in enumerate(world_ranking.labels):
            keep_error(findings, f"rmse_{label}{end}", world_ranking, row)
        with session.drawing():
            draw_intervals(findings, world_ranking, end)
    return rankings
