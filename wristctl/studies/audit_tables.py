"""The ledger as tables: every claim with a column for each loop, why, and what is still open."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from wristctl.report.printed_table import Table

if TYPE_CHECKING:
    from wristctl.comparison.ledger import Judgement
    from wristctl.comparison.verdicts import Finding

SETTING = "(a setting)"
"""In place of a verdict."""


def ledger_tables(judged: Sequence[Judgement]) -> list[Table]:
    """The claims, by loop where loops decide; then why, what is open, and how many there are of each verdict."""
    loops = list(dict.fromkeys(name for j in judged for name in j.found if name))
    by_loop = [j for j in judged if any(name for name in j.found)]
    others = [j for j in judged if j not in by_loop]
    heads = ("claim", "the paper says", "paper", "unit")
    tables = []
    if by_loop:
        rows = [(*_claim(j), *(part for name in loops for part in _cells(j.found.get(name)))) for j in by_loop]
        pairs = [part for name in loops for part in (f"ours, {name}", f"verdict, {name}")]
        tables.append(Table("Claims that rollouts decide", (*heads, *pairs), rows))
    if others:
        rows = [(*_claim(j), *_cells(j.found.get("")), ", ".join(j.shown_by)) for j in others]
        tables.append(Table("Other claims", (*heads, "ours", "verdict", "shown by"), rows))
    why = [(j.claim.id, j.verdict, j.reason) for j in judged if j.verdict not in (None, "open") and j.reason]
    still = [(j.claim.id, j.reason) for j in judged if j.verdict == "open"]
    return [
        *tables,
        Table("Why", ("claim", "verdict", "reason"), why),
        Table("Still open", ("claim", "what would decide it"), still),
        Table("Verdicts", ("verdict", "claims"), sorted(Counter(j.verdict or SETTING for j in judged).items())),
    ]


def _claim(judgement: Judgement) -> Iterator[str]:
    claim = judgement.claim
    yield from (
        claim.id,
        claim.says,
        "" if claim.value is None else _bound(claim.sense) + f"{claim.value:g}",
        claim.unit,
    )


def _bound(sense: str) -> str:
    return {"at most": "<= ", "at least": ">= "}.get(sense, "")


def _cells(found: Finding | None) -> tuple[str, str]:
    """Our range and the verdict, marked where it must be."""
    from wristctl.comparison.ledger import interval

    if found is None:
        return "", SETTING
    mark = f" ({found.mark})" if found.mark else ""
    ours = "" if found.low != found.low and not found.reason.startswith("fails") else interval(found.low, found.high)
    return ours, found.verdict + mark
