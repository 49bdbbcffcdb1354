"""Files and figures of a ranking over worlds: the part of `compare` that names a family."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

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
    from wristctl.plotting.ranking_figures import ranking_intervals
    from wristctl.simulation.drawn_worlds import streams_of

    findings, worlds = session.findings, study.compare.worlds
    with session.progress("ranking", 100, "%", after=after_rollouts(len(study.compare.rows))) as report:
        rankings = rank(study, tuned, network, lambda share: report(round(100 * share)))
    if worlds.sealed is None:
        findings.note_streams(streams_of(study.families[worlds.family], worlds.family, worlds.split))
    units = ranked_units() | {f"rmse_{end}": "rad" for end in ("low", "high")}
    ranking = pd.concat([ranking_frame(one_ranking) for one_ranking in rankings], ignore_index=True)
    findings.table("data/ranking.csv", ranking, units=units | {"worst_rmse": "rad"})
    frames = pd.concat([worlds_frame(one_ranking) for one_ranking in rankings], ignore_index=True)
    findings.table("data/worlds.csv", frames, units=units)
    for index, world_ranking in enumerate(rankings):
        end = "_steps" if index else ""
        for label, mean in zip(world_ranking.labels, world_ranking.means, strict=True):
            ends = (mean.low, mean.high) if math.isfinite(mean.high) else None
            findings.metric(f"rmse_{label}{end}", mean.value, "rad", "lower", world_ranking.count, ends)
        with session.drawing():
            caption = f"RMSE of every controller on {world_ranking.name}, with 95 % intervals over worlds"
            findings.figure(f"ranking{end}", ranking_intervals, world_ranking, caption=caption)
    return rankings
