"""The answer of an audit in words: what of the paper holds, where, what speaks against it, and what is open."""

from __future__ import annotations

import textwrap
from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from wristctl.comparison.ledger import Judgement
    from wristctl.comparison.robust import Strip

LINES, COLUMNS = 12, 100
"""What an answer may take of a terminal."""
_ORDER = ("reproduced", "better than the paper", "worse than the paper", "contradicted", "not specified enough", "open")


def answer_of(judged: Sequence[Judgement], strips: Sequence[Strip] = ()) -> list[str]:
    """At most LINES lines of at most COLUMNS columns; `strips` are the claims over the box."""
    claims = [j for j in judged if j.verdict is not None]
    counted = Counter(str(j.verdict) for j in claims)
    counts = ", ".join(f"{counted[each]} {each}" for each in _ORDER if counted[each])
    settings = len(judged) - len(claims)
    beside = f" ({_many(settings, 'setting')} taken over.)" * bool(settings)
    lines = _wrapped(f"{_many(len(claims), 'claim')} of the paper: {counts}.{beside}", 2)
    for loop in dict.fromkeys(name for j in claims for name in j.found if name):
        own = {j.claim.id: j.found[loop] for j in claims if loop in j.found}
        kept = {name: each.mark for name, each in own.items() if each.verdict == "reproduced"}
        held = [name + f" ({mark})" * bool(mark) for name, mark in kept.items()]
        lines += _wrapped(f"On {loop} {len(held)} of {len(own)} reproduced{_listed(held)}.", 2)
    others = [j.claim.id for j in claims if j.verdict == "reproduced" and "" in j.found]
    if others:
        lines += _wrapped(f"Beside rollouts reproduced{_listed(others)}.", 1)
    against = [j.claim.id for j in claims if any(each.verdict == "contradicted" for each in j.found.values())]
    if against:
        lines += _wrapped(f"Contradicted by the paper's own equations or words{_listed(against)}.", 2)
    lines += _over_the_box(strips)
    missing = [j for j in claims if j.verdict == "open"]
    if missing:
        wanted = [f"--{name}" for name in dict.fromkeys(j.claim.evidence for j in missing if j.claim.evidence in _RUNS)]
        lines += _wrapped(f"{_many(len(missing), 'claim')} open: give {', '.join(wanted) or 'more seeds'}.")
    return [*lines[: LINES - 1], "All claims with reasons: `wristctl audit ... --all`, or the run's README.md."]


def _over_the_box(strips: Sequence[Strip]) -> list[str]:
    """Where the laws arrive, and what decides the claims on the paper's own laws."""
    if not strips:
        return []
    arrive = [each for each in strips if each.claim.id.startswith("A-")]
    said = [f"{each.claim.label} {100 * each.share('reproduced').value:.0f} % ({each.told})" for each in arrive]
    begin = f"Over {len(strips[0].verdicts)} settings that the paper may have had, 30 deg are reached by"
    lines = _wrapped(f"{begin} {', '.join(said)}.", 2)
    orders = [each for each in strips if each.claim.than and not each.claim.unspecified]
    most = [f"{each.claim.id} {100 * each.share('reproduced').value:.0f} %" for each in orders]
    return lines + _wrapped(f"Its orderings of its own two laws hold in: {', '.join(most)}.", 2) * bool(orders)


_RUNS = ("table1", "selection", "hardware")


def _many(count: int, what: str) -> str:
    return f"{count} {what}{'s' * (count != 1)}"


def _listed(names: Sequence[str]) -> str:
    return f": {', '.join(names)}" if names else ""


def _wrapped(text: str, most: int = 1) -> list[str]:
    """Lines of a text; what is beyond the last is left out, and a mark says so."""
    lines = textwrap.wrap(text, COLUMNS, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)
    if len(lines) > most:
        lines = textwrap.wrap(
            text, COLUMNS, subsequent_indent="  ", max_lines=most, placeholder=" ...", break_on_hyphens=False
        )
    return lines
