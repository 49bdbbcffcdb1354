"""Tables of every claim of an audit, by whom it is and what decides it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from wristctl.commands.printed_table import Table

if TYPE_CHECKING:
    from wristctl.comparison.claims import Judgement
    from wristctl.comparison.verdicts import Finding
    from wristctl.config.audit import Claim


def ledger_tables(judged: Sequence[Judgement]) -> list[Table]:
    """Sections of claims, by loop where loops decide; then why, what is open, and how many of the paper's have which
    verdict."""
    from wristctl.comparison.claims import worded

    claims = [j for j in judged if j.verdict is not None]
    settings = [j for j in judged if j.verdict is None]
    tables = []
    for title, other_title, kind in (
        ("Claims of the paper that rollouts decide", "Other claims of the paper", "paper"),
        ("Details that rollouts decide", "Other details", "part"),
        ("Our own checks that rollouts decide", "Our own other checks", "ours"),
        ("Rollouts on what the paper's authors say elsewhere", "What the paper's authors say elsewhere", "group"),
    ):
        tables += _section(title, other_title, [j for j in claims if _kind(j.claim) == kind])
    if settings:
        tables.append(Table("Settings taken over as printed", ("setting", "the paper says", "paper", "unit"),
                            [tuple(_claim(j)) for j in settings]))  # fmt: skip
    why = [(j.claim.id, worded(j.claim, str(j.verdict)), j.reason) for j in claims if j.verdict != "open" and j.reason]
    still = [(j.claim.id, j.reason) for j in claims if j.verdict == "open"]
    counted = Counter(str(j.verdict) for j in claims if _kind(j.claim) == "paper")
    return [
        *tables,
        Table("Why", ("claim", "verdict", "reason"), why),
        Table("Still open", ("claim", "what would decide it"), still),
        Table("Verdicts on the claims of the paper", ("verdict", "claims"), sorted(counted.items())),
    ]


def _kind(claim: Claim) -> str:
    return "part" if claim.part_of else claim.whose


def _section(title: str, title_of_others: str, judged: Sequence[Judgement]) -> list[Table]:
    """Tables of a section: the claims that loops decide, and the remaining claims."""
    from wristctl.comparison.claims import worded

    by_loop = [j for j in judged if any(name for name in j.found)]
    remaining = [j for j in judged if j not in by_loop]
    loops = list(dict.fromkeys(name for j in by_loop for name in j.found if name))
    heads, tables = ("claim", "says", "paper", "unit"), []
    if by_loop:
        pairs = [part for name in loops for part in (f"ours, {name}", f"verdict, {name}")]
        cells = [[part for name in loops for part in _cells(j.claim, j.found.get(name))] for j in by_loop]
        rows = [(*_claim(j), worded(j.claim, str(j.verdict)), *row) for j, row in zip(by_loop, cells, strict=True)]
        tables.append(Table(title, (*heads, "verdict", *pairs), rows))
    if remaining:
        sources = any(j.claim.source for j in remaining)
        rows = [
            (*_claim(j), *_cells(j.claim, j.found.get("")), ", ".join(j.shown_by), *(j.claim.source,) * sources)
            for j in remaining
        ]
        tables.append(Table(title_of_others, (*heads, "ours", "verdict", "shown by", *("source",) * sources), rows))
    return tables


def _claim(judgement: Judgement) -> Iterator[str]:
    claim = judgement.claim
    yield from (
        claim.id,
        claim.says,
        "" if claim.value is None else {"at most": "<= ", "at least": ">= "}.get(claim.sense, "") + f"{claim.value:g}",
        claim.unit,
    )


def _cells(claim: Claim, finding: Finding | None) -> tuple[str, str]:
    """Our range and the verdict, marked where it must be."""
    from wristctl.comparison.claims import interval, worded

    if finding is None:
        return "", ""
    mark = f" ({finding.mark})" if finding.mark else ""
    without = finding.low != finding.low and not finding.reason.startswith("fails")
    return "" if without else interval(finding.low, finding.high), worded(claim, finding.verdict) + mark
