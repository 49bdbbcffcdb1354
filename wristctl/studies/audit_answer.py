"""The answer of an audit in words: what of the paper holds, where, what speaks against it, and what is open."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from wristctl.studies.answer_lines import in_lines

if TYPE_CHECKING:
    from wristctl.comparison.ledger import Judgement
    from wristctl.comparison.robust import Strip

LINES = 12
"""What an answer may take of a terminal."""
_ORDER = ("reproduced", "better than the paper", "worse than the paper", "contradicted", "not specified enough", "open")


class _Part(NamedTuple):
    """A sentence of the answer; a list may lose what is beyond its last line, where others need the room."""

    text: str
    most: int = 1
    is_list: bool = False


def answer_of(judged: Sequence[Judgement], strips: Sequence[Strip] = ()) -> list[str]:
    """At most LINES lines; `strips` are the claims over the box."""
    claims = [j for j in judged if j.verdict is not None]
    counted = Counter(str(j.verdict) for j in claims)
    counts = ", ".join(f"{counted[each]} {each}" for each in _ORDER if counted[each])
    settings = len(judged) - len(claims)
    beside = f" {_many(settings, 'setting is', 'settings are')} taken over." * bool(settings)
    parts = [_Part(f"{_many(len(claims), 'claim')} of the paper, by what all loops agree on: {counts}.{beside}", 2)]
    for loop in dict.fromkeys(name for j in claims for name in j.found if name):
        own = {j.claim.id: j.found[loop] for j in claims if loop in j.found}
        kept = {name: each.mark for name, each in own.items() if each.verdict == "reproduced"}
        marked = "".join(f", {times} of these {mark}" for mark, times in Counter(filter(None, kept.values())).items())
        parts.append(_Part(f"On {loop} {len(kept)} of {len(own)} reproduced{marked}{_listed(list(kept))}.", 2, True))
    others = [j.claim.id for j in claims if j.verdict == "reproduced" and "" in j.found]
    if others:
        parts.append(_Part(f"Without a rollout reproduced{_listed(others)}.", 1, True))
    against = [j.claim.id for j in claims if any(each.verdict == "contradicted" for each in j.found.values())]
    if against:
        parts.append(_Part(f"Contradicted by the paper's own equations or words{_listed(against)}.", 2, True))
    parts += _over_the_box(strips)
    missing = [j for j in claims if j.verdict == "open"]
    if missing:
        named = dict.fromkeys(j.claim.evidence for j in missing if j.claim.evidence in _RUNS)
        wanted = [f"--{name} RUN ({_RUNS[name]})" for name in named]
        parts.append(_Part(f"{_many(len(missing), 'claim')} open, for want of {', '.join(wanted) or 'seeds'}."))
    return [*_fitted(parts, LINES - 1), "All claims with reasons: `wristctl audit ... --all`, or the run's README.md."]


def _over_the_box(strips: Sequence[Strip]) -> list[_Part]:
    """Where the laws arrive, and what decides the claims on the paper's own laws."""
    if not strips:
        return []
    arrive = [each for each in strips if each.claim.id.startswith("A-")]
    said = [
        f"{each.claim.label} in {100 * each.share('reproduced').value:.2g} %" + f" ({each.told})" * bool(each.told)
        for each in arrive
    ]
    begin = f"Over {len(strips[0].verdicts)} settings that the paper may have had, 30 deg are reached by"
    parts = [_Part(f"{begin} {', '.join(said)}.", 3)]
    orders = [each for each in strips if each.claim.than and not each.claim.unspecified]
    most = [f"{each.claim.id} {100 * each.share('reproduced').value:.0f} %" for each in orders]
    return parts + [_Part(f"Its orderings of its own two laws hold in: {', '.join(most)}.", 2)] * bool(orders)


def _fitted(parts: Sequence[_Part], room: int) -> list[str]:
    """The lines of all parts, of which none goes for another: lists are cut, the longest first."""
    lines = [in_lines(part.text, most=part.most, indent="  ") for part in parts]
    while sum(map(len, lines)) > room:
        long = [at for at, part in enumerate(parts) if part.is_list and len(lines[at]) > 1]
        if not long:
            break
        at = max(long, key=lambda each: (len(lines[each]), each))
        lines[at] = in_lines(parts[at].text, most=len(lines[at]) - 1, indent="  ")
    return [line for part in lines for line in part][:room]


_RUNS = {"table1": "train", "selection": "train", "hardware": "hw-run"}
"""The earlier runs that claims may want, and what leaves them."""


def _many(count: int, what: str, several: str = "") -> str:
    return f"{count} {what if count == 1 else several or f'{what}s'}"


def _listed(names: Sequence[str]) -> str:
    return f": {', '.join(names)}" if names else ""
