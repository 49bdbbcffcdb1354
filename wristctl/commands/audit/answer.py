"""The answer of an audit: a first screen of plain sentences on what of the paper holds, and tables of every claim.

Every sentence is chosen by the verdicts. A reader of the paper may repeat it, so none says more than they do.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

from wristctl.commands.printed_table import COLUMNS, Table, in_lines
from wristctl.config.loop import LOOPS

if TYPE_CHECKING:
    from wristctl.comparison.claims import Judgement
    from wristctl.comparison.robust import Strip
    from wristctl.comparison.verdicts import Finding
    from wristctl.config.audit import Claim


# Lines of a terminal that the first screen may take.
LINES = 24
# Claims shown with both numbers; one less where a box was drawn.
_HEAVIEST = 5
_MORE = "All claims with reasons: `wristctl audit ... --all`, or README.md of the run. Words: docs/index.md."


def answer_of(judged: Sequence[Judgement], strips: Sequence[Strip] = (), limit: float = math.inf) -> list[str]:
    """At most LINES lines; `strips` are the claims over the box, `limit` is of the wrist's tendons [N]."""
    claims = [j for j in judged if j.verdict is not None]
    loops = list(dict.fromkeys(name for j in claims for name in j.found if name))
    table = _numbers(claims, loops, _HEAVIEST - bool(strips))
    loose, box = _by_topic(claims), _over_the_box(strips)
    first, second = [*_conditions(loops, limit), *_gains(claims), *_ranking(claims, loops)], [*loose, *box]
    return [*_fitted([first, second, [*_networks(claims), *_untested(claims)]], LINES - 1 - len(table)), *table, _MORE]


def _fitted(paragraphs: Sequence[Sequence[str]], room: int) -> list[str]:
    """Paragraphs of sentences in at most `room` lines; whole sentences are left out from the end."""
    lines = [line for paragraph in paragraphs for line in in_lines(" ".join(paragraph))]
    if len(lines) <= room or not paragraphs:
        return lines
    *earlier, last = paragraphs
    return _fitted([*earlier, last[:-1]] if last else earlier, room)


def _conditions(loops: Sequence[str], limit: float) -> list[str]:
    descriptions = [f"{name} ({_described(name, limit)})" for name in loops]
    return [f"The paper's claims, tried in simulation on the loops {_and(descriptions)}."] * bool(loops)


def _described(loop: str, limit: float) -> str:
    """Segments, control rate and tension limit of a built-in loop, in words."""
    builtin = LOOPS.get(loop)
    if builtin is None:
        return "a loop of yours"
    n, rate = builtin.plant_segments, 1e-3 / builtin.control_period
    ticks = "nearly continuous" if rate >= 100.0 else f"{rate:g} kHz"
    tensions = f"{limit:g} N" if builtin.limits and math.isfinite(limit) else "no tension limit"
    return f"{n} segment{'s' * (n > 1)}, {ticks}, {tensions}"


# Rows that the paper prints, and the one of ours: what they are, and in short.
_GAINS = {
    "smc/printed": ("its sliding mode controller (SMC) with the printed gains", "SMC as printed"),
    "smc/exchanged": ("SMC with P1 and P2 exchanged (a guess of ours)", "SMC with P1 and P2 exchanged"),
    "pid/printed": ("its PID with the printed gains", "PID as printed"),
}


def _gains(claims: Sequence[Judgement]) -> list[str]:
    """Loops on which each set of gains reaches 30 deg, and loops on which it gives T2's RMSE."""
    arrivals, numbers = [], []
    for label, (who, short) in _GAINS.items():
        labelled = [j for j in claims if j.claim.label == label]
        if arrival := _one(j for j in labelled if j.claim.evidence == "arrival"):
            arrivals.append(f"by {who} {_places(arrival.found)}")
        if number := _one(j for j in labelled if _is_number(j.claim, "rmse")):
            numbers.append(f"for {short} {_places(number.found)}{_mark(number.found)}")
    sentences = [f"30 deg are reached {', '.join(arrivals)}."] if arrivals else []
    return sentences + [f"The printed RMSE comes out {', '.join(numbers)}."] * bool(numbers)


def _is_number(claim: Claim, metric: str) -> bool:
    """Whether it is a printed number of this metric, judged on loops as the paper's wrist is."""
    return (
        (claim.evidence, claim.metric) == ("comparison", metric)
        and claim.whose == "paper"
        and claim.sense == "about"
        and claim.stiffness_scale == 1.0
    )


def _mark(findings: Mapping[str, Finding]) -> str:
    reproduced = _where(findings, "reproduced")
    beyond = [name for name in reproduced if findings[name].mark]
    where = f"on {_and(beyond)} " * (len(reproduced) > len(beyond))
    return f" ({where}with tensions that no tendon bears)" * bool(beyond)


def _ranking(claims: Sequence[Judgement], loops: Sequence[str]) -> list[str]:
    """SMC against PID, and the whole order of T2 with our designs of what the paper only names."""
    from wristctl.comparison.paper import T2

    pairs = []
    for gains, wording in (("printed", "as printed"), ("exchanged", "with P1 and P2 exchanged")):
        one = _one(j for j in claims if _is_order(j.claim, f"smc/{gains}", "pid/printed"))
        pairs += [f"{wording} {_places(one.found)}"] if one else []
    sentences = [f"SMC has less RMSE than PID: {'; '.join(pairs)}."] if pairs else []
    order = sorted(T2, key=lambda name: T2[name].rmse)
    links = [_one(j for j in claims if _is_order(j.claim, f"{a}/", f"{b}/")) for a, b in pairwise(order)]
    tried = [link for link in links if link is not None]
    if len(tried) < len(links):
        return sentences
    named = [name.upper() for name in order if name not in ("smc", "pid")]
    holds = [
        loop
        for loop in loops
        if all(
            (finding := link.found.get(loop)) and (finding.beside or finding.verdict) == "reproduced" for link in tried
        )
    ]
    return [
        *sentences,
        f"The ranking {' < '.join(name.upper() for name in order)} in RMSE cannot be judged: the paper gives no "
        f"equations of {_and(named)}; with designs of ours and P1 and P2 exchanged it holds {_on(holds, loops)}.",
    ]


def _is_order(claim: Claim, less: str, more: str) -> bool:
    """Whether it says that the RMSE of the one, which begins so, is less than that of the other."""
    return (
        (claim.evidence, claim.metric) == ("ordering", "rmse")
        and claim.label.startswith(less)
        and str(claim.than).startswith(more)
    )


def _over_the_box(strips: Sequence[Strip]) -> list[str]:
    """In which share of the settings that the paper may have had gains arrive, and give a whole row of T2."""
    from wristctl.comparison.paper import FACTOR

    in_box = {evidence: [strip for strip in strips if strip.claim.evidence == evidence] for evidence in _IN_BOX}
    used = [strip for parts in in_box.values() for strip in parts]
    if not used:
        return []
    shares = {
        evidence: _and([f"{_short(strip.claim.label)} in {_share(strip)}" for strip in parts])
        for evidence, parts in in_box.items()
    }
    sentences = []
    if in_box["arrival"]:
        resting = any(strip.share("reproduced").times for strip in in_box["arrival"])
        also = " (also by wrists that rest there whatever is asked of them)" * resting
        sentences.append(f"30 deg are reached with {shares['arrival']}{also}")
    if in_box["together"]:
        sentences.append(
            f"T2's three numbers come out at once, within a factor of {FACTOR:g}, with {shares['together']}"
        )
    left = sorted({strip.uncounted for strip in used})
    many = f"{left[0]} to {left[-1]}" if len(left) > 1 else f"{left[0]}"
    open_ = f" ({many} did not converge and are not counted)" * bool(left[-1])
    return [f"Of {len(strips[0].verdicts)} settings that the paper may have had{open_} {'; '.join(sentences)}."]


# Claims over the box that the first screen tells.
_IN_BOX = ("arrival", "together")


def _short(label: str) -> str:
    return _GAINS[label][1].replace("with P1 and P2 exchanged", "exchanged") if label in _GAINS else label


def _share(one: Strip) -> str:
    """Share of the settings that have a verdict."""
    held = one.share("reproduced")
    return _percent(held.value) if held.n else "no setting that converged"


def _networks(claims: Sequence[Judgement]) -> list[str]:
    """T1: whether sigmoid is the best, and whether it learns, in the ways of training that the paper leaves open."""
    tested = [j for j in claims if j.claim.evidence == "table1" and j.claim.part_of and j.shown_by]
    best = [j for j in tested if str(j.claim.metric).endswith("_is_best")]
    beaten = [j for j in tested if str(j.claim.metric).endswith("_is_beaten")]
    learns = [j for j in tested if str(j.claim.metric).endswith("_median_r2")]
    sentences = []
    if best:
        shown = [j.claim.says for j in best if j.verdict == "reproduced"]
        count = len([j for j in beaten if j.verdict == "reproduced"])
        also = f", and another to be more accurate in {count or 'none'}" * bool(beaten)
        which = f" ({'; '.join(shown)})" if 0 < len(shown) < len(best) else ""
        sentences.append(
            f"Of {len(best)} ways to train its networks, between which it does not tell, sigmoid is shown to be the "
            f"most accurate in {len(shown) or 'none'}{which}{also}."
        )
    for verdict, wording in (("does not hold", "does not learn"), ("open", "may or may not learn")):
        trainings = [j.claim.says for j in learns if j.verdict == verdict]
        if trainings:
            sentences.append(f"Sigmoid {wording} (R^2 of {learns[0].claim.value:g}) with {'; with '.join(trainings)}.")
    if learns and all(j.verdict == "reproduced" for j in learns):
        sentences.append(f"Sigmoid learns (R^2 of {learns[0].claim.value:g}) in all of them.")
    return sentences


def _by_topic(claims: Sequence[Judgement]) -> list[str]:
    """Topics that the paper's own words or equations contradict, and topics that they leave open."""
    topical = [j for j in claims if j.claim.topic and j.claim.whose == "paper" and not j.claim.weight]
    sentences = []
    for verdict, begin in (
        ("not specified enough", "Cannot be told, since the paper does not say enough"),
        ("contradicted", "Contradicted by its own equations or words"),
    ):
        topics = [j.claim.topic for j in topical if j.verdict == verdict and not j.claim.part_of]
        if topics:
            sentences.append(f"{begin}: {', '.join(topics)}.")
    return sentences


# Subjects of the claims that want an earlier run.
_RUNS = {"table1": "the table of networks", "selection": "the number of layers", "hardware": "the experiment"}


def _untested(claims: Sequence[Judgement]) -> list[str]:
    wanted = dict.fromkeys(j.claim.evidence for j in claims if j.verdict == "open" and j.claim.evidence in _RUNS)
    missing = [f"{_RUNS[name]} (--{name} RUN)" for name in wanted]
    return [f"Not tested here: {', '.join(missing)}."] if missing else []


def _numbers(claims: Sequence[Judgement], loops: Sequence[str], most: int) -> list[str]:
    """The heaviest claims with the paper's number and ours, on each loop."""
    heavy = sorted((j for j in claims if j.claim.weight and j.claim.value), key=lambda j: -j.claim.weight)[:most]
    if not heavy or not loops:
        return []
    rows = [("(*: reproduced)", "the paper", *loops)]
    for j in heavy:
        cells = [_ours(j.found[name]) if name in j.found else "not tried" for name in loops]
        rows.append((j.claim.topic or j.claim.says, f"{j.claim.value:g} {j.claim.unit}".strip(), *cells))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    widths[0] = min(widths[0], COLUMNS - sum(widths[1:]) - 2 * len(loops) - 2)
    return [
        "  ".join(cell[:width].ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows
    ]


def _ours(finding: Finding) -> str:
    from wristctl.comparison.claims import interval

    if math.isnan(finding.low):
        return "fails"
    return interval(finding.low, finding.high) + "*" * (finding.verdict == "reproduced")


def _places(findings: Mapping[str, Finding]) -> str:
    """On which loops something is so, on which for some motions only, and on which two are alike."""
    loops, open_ = [name for name in findings if name], _where(findings, "not specified enough")
    alike = [name for name in open_ if findings[name].reason.startswith("alike")]
    some = [name for name in open_ if name not in alike]
    places = [_on(_where(findings, "reproduced"), loops)]
    places += [f"for some motions only on {_and(some)}"] * bool(some)
    places += [f"as much as it on {_and(alike)}"] * bool(alike)
    return ", ".join(places)


def _on(holding: Sequence[str], loops: Sequence[str]) -> str:
    if len(holding) == len(loops) > 1:
        return "on all loops"
    return f"on {_and(holding)}{' alone' * (len(loops) > 1 == len(holding))}" if holding else "on no loop"


def _where(findings: Mapping[str, Finding], verdict: str) -> list[str]:
    return [name for name, finding in findings.items() if name and finding.verdict == verdict]


def _one(judged: Iterable[Judgement]) -> Judgement | None:
    """The first that was judged on loops."""
    return next((judgement for judgement in judged if any(name for name in judgement.found)), None)


def _percent(share: float) -> str:
    """Two digits; 0 and 100 % are none and all, and nothing else is."""
    percent = 100.0 * share
    return f"{min(percent, 99.0) if share < 1.0 else percent:.0f} %" if percent >= 10.0 else f"{percent:.2g} %"


def _and(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}" if names else ""


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
        rows = [
            (
                *_claim(j),
                worded(j.claim, str(j.verdict)),
                *(part for name in loops for part in _cells(j.claim, j.found.get(name))),
            )
            for j in by_loop
        ]
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
        "" if claim.value is None else _bound(claim.sense) + f"{claim.value:g}",
        claim.unit,
    )


def _bound(sense: str) -> str:
    return {"at most": "<= ", "at least": ">= "}.get(sense, "")


def _cells(claim: Claim, finding: Finding | None) -> tuple[str, str]:
    """Our range and the verdict, marked where it must be."""
    from wristctl.comparison.claims import interval, worded

    if finding is None:
        return "", ""
    mark = f" ({finding.mark})" if finding.mark else ""
    ours = (
        ""
        if finding.low != finding.low and not finding.reason.startswith("fails")
        else interval(finding.low, finding.high)
    )
    return ours, worded(claim, finding.verdict) + mark
