"""Who decides a ranking in words: controllers, or the limits of tensions and motors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from wristctl.commands.printed_table import joined
from wristctl.commands.ranking_words import condition, winner

if TYPE_CHECKING:
    from wristctl.comparison.controller_ranking import Ranking


def decided(rankings: Sequence[Ranking]) -> str:
    """How long the best are at a limit of tensions or motors, and where motors make several of them alike.

    Where none can be used it is told of the one with the least error.
    """
    from wristctl.comparison.controller_ranking import MOTORS_DECIDE

    shares, motors = list[str](), list[str]()
    known = [ranking for ranking in rankings if ranking.at_limit]
    for ranking in known:
        row = winner(ranking, rankings)
        row = ranking.standing.order[0] if row is None else row
        where = f"{condition(ranking)} " if len(rankings) > 1 else ""
        told = [f"{limit} {100.0 * of_rows[row]:.2g} %" for limit, of_rows in ranking.at_limit.items()]
        limited = any(of_rows[row] > 0.0 for of_rows in ranking.at_limit.values())
        shares += [f"{where}{', '.join(told)}"] * limited
        motors += [condition(ranking)] * ranking.motors_decide
    if not known:
        return ""
    text = f"Share of time at a limit, of the best: {'; '.join(shares) or 'none'}."
    if not motors:
        return text
    where = f"In {joined(motors)} motors" if len(rankings) > 1 else "There motors"
    return (
        f"{text} {where} decide: all that tie for the best, or all where none can be used, wait for "
        f"theirs for {100.0 * MOTORS_DECIDE:g} % of the time or more. Quicker motors can tell controllers apart."
    )
