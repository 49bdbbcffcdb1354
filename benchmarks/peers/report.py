"""Tables in Markdown of one result."""

from __future__ import annotations

from claims import Claim
from rates import Result


def number(value: float | None) -> str:
    """A rate or a ratio to two digits, whole from 10 on; a dash where there is none."""
    if value is None:
        return "-"
    return f"{value:,.0f}" if value >= 10 else f"{value:.2g}"


def markdown(result: Result) -> str:
    """A table for each number of segments and of threads: steps, error, rates and wristctl's ratio to each side."""
    parts = []
    for n in result.axis("segments"):
        for threads in result.axis("threads"):
            lanes = [count for count in result.axis("lanes") if count > 1 or threads == 1]
            parts.append(f"### n = {n}, {'one thread' if threads == 1 else f'{threads} threads'}\n")
            counts = [f"{count:,} lane{'s' if count > 1 else ''}" for count in lanes]
            columns = ["side", "steps a tick", "error [rad]", *counts, "wristctl over it"]
            parts.append("| " + " | ".join(columns) + " |\n|" + "---|" * len(columns))
            for variant in result.variants(n):
                rates = [result.rate(variant, n, threads, count) for count in lanes]
                best = [result.own_rate(n, threads, count) for count in lanes]
                ratios = [number(a / b) if a and b else "-" for a, b in zip(best, rates, strict=True)]
                error = f"{variant.error:.1e}" + ("" if variant.equal else " (larger)")
                cells = [variant.side, str(variant.steps), error, *map(number, rates), " / ".join(ratios)]
                parts.append("| " + " | ".join(cells) + " |")
            parts.append("")
    return "\n".join(parts)


def claims_table(claims: list[Claim]) -> str:
    """What is wanted, what was measured, and whether it holds."""
    lines = ["| wanted | measured | |\n|---|---|---|"]
    lines += [f"| {claim.wanted} | {claim.measured} | {claim.verdict} |" for claim in claims]
    missed = [f"- {claim.wanted}: {claim.why}." for claim in claims if claim.holds is False and claim.why]
    lines += ["\nWhat stops those that are missed:\n", *missed] if missed else []
    return "\n".join(lines) + "\n"
