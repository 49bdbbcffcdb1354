"""The answer of an audit: what of the paper holds in simulation, on which loops, and what cannot be tested.

Every sentence is chosen by the verdicts. A reader of the paper may repeat it, so none says more than they do.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

from wristctl.commands.answer import Answer, rest
from wristctl.commands.printed_table import Table, capital, degrees, joined
from wristctl.config.loop import LOOPS

if TYPE_CHECKING:
    from wristctl.comparison.claims import Judgement
    from wristctl.comparison.robust import Strip
    from wristctl.comparison.verdicts import Finding
    from wristctl.config.audit import Claim


# Claims shown with both numbers, and so many where a box was drawn.
_HEAVIEST, _BESIDE_A_BOX = 5, 3
# Sample rate from which control is as good as continuous [kHz].
_CONTINUOUS = 100.0
# Verdict where motions or loops differ.
_OPEN = "not specified enough"
_COUNTS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine")


def answer_of(
    judged: Sequence[Judgement], strips: Sequence[Strip] = (), limit: float = math.inf, run: str = ""
) -> Answer:
    """What holds, the heaviest claims with both numbers, and what is contradicted, open or not tested.

    One screen; sentences are left out from the end.

    Parameters
    ----------
    judged
        Every claim with its findings.
    strips
        Claims over the box of unknowns.
    limit
        Tension limit of the wrist's tendons [N].
    run
        Path of the run; empty for a result in memory.
    """
    claims = [j for j in judged if j.verdict is not None]
    loops = list(dict.fromkeys(name for j in claims for name in j.found if name))
    sentence = " ".join([*_tried(loops, limit), *_controllers(claims)]) or "No claim of this ledger is tried on a loop."
    table = _numbers(claims, loops, _BESIDE_A_BOX if strips else _HEAVIEST)
    ranked = [*_ranking(claims, loops), *_softened(claims)]
    first, *second = [" ".join(part) for part in (_over_the_box(strips), ranked) if part] or [""]
    networks = " ".join(_networks(claims))
    decided = [first] if first else []
    sentences = [*[networks] * bool(networks), *_by_topic(claims), *second, *_untested(claims)]
    more = rest("Settling, pushes and every claim with its reason", run)
    return Answer(sentence, table, decided, more).ending(sentences)


def _tried(loops: Sequence[str], limit: float) -> list[str]:
    kinds = [f"{_word(name)} ({_described(name, limit)})" if name in LOOPS else name for name in loops]
    count = _COUNTS[len(loops)] if len(loops) < len(_COUNTS) else len(loops)
    plural = "s" * (len(loops) > 1)
    bare = all(name in LOOPS and LOOPS[name].actuator.level == "ideal" for name in loops)
    where = f"{count} loop{plural} of ours{' without motors or camera' * bare}, as the paper describes none"
    return [f"Smooth moves of 30 deg in 1 and 2 s on {where}: {joined(kinds)}."] * bool(loops)


def _word(name: str) -> str:
    """A built-in loop by what distinguishes it: ideal, sampled or 4-segment."""
    builtin = LOOPS.get(name)
    if builtin is None:
        return name
    if builtin.plant_segments > 1:
        return f"{builtin.plant_segments}-segment"
    return "ideal" if 1e-3 / builtin.control_period >= _CONTINUOUS else "sampled"


def _described(name: str, limit: float) -> str:
    """What the word for a built-in loop leaves unsaid."""
    n, rate = LOOPS[name].plant_segments, 1e-3 / LOOPS[name].control_period
    ticks = f"{1e-3 * rate:g} MHz" if rate >= _CONTINUOUS else f"{rate:g} kHz"
    tensions = f"up to {limit:g} N" if LOOPS[name].limits and math.isfinite(limit) else "any tension"
    return ", ".join(part for part in ("one segment" * (n == 1), ticks, tensions) if part)


# What the paper prints, and the one of ours.
_GAINS = {
    "smc/printed": "sliding mode control (SMC) with the paper's gains",
    "smc/exchanged": "SMC with P1 and P2 exchanged (our guess)",
    "pid/printed": "PID with the paper's gains (sign turned)",
}


def _controllers(claims: Sequence[Judgement]) -> list[str]:
    """Of each set of gains the loops on which it arrives, and those on which it has the printed RMSE."""
    from wristctl.simulation.arrival import SHORT

    sentences = list[str]()
    for label, who in _GAINS.items():
        labelled = [j for j in claims if j.claim.label == label]
        arrival = _one(j for j in labelled if j.claim.evidence == "arrival")
        number = _one(j for j in labelled if _is_number(j.claim, "rmse"))
        who = f"{who[0].upper()}{who[1:]}"
        within = f" (to within {_percent(SHORT)})" * (not sentences)
        facts = [f"arrives{within} {_places(arrival.found)}"] if arrival else []
        ever = [_where(one.found, verdict) for one in (arrival, number) if one for verdict in ("reproduced", _OPEN)]
        if number and (not arrival or any(ever)):
            facts.append(f"has the paper's RMSE {_places(number.found)}{_beyond(number.found)}")
        sentences += [f"{who} {' and '.join(facts)}."] if facts else []
    return sentences


def _is_number(claim: Claim, metric: str) -> bool:
    """Whether it is a printed number of this metric, tried on loops as the paper's wrist is."""
    return (
        (claim.evidence, claim.metric) == ("comparison", metric)
        and claim.whose == "paper"
        and claim.sense == "about"
        and claim.stiffness_scale == 1.0
    )


def _beyond(findings: Mapping[str, Finding]) -> str:
    """Where the number is smaller than the paper's, and where it takes tensions above the limit."""
    reproduced = _where(findings, "reproduced")
    beyond = [name for name in reproduced if "not physical" in findings[name].mark]
    where = f" {_on(beyond)}" * (len(reproduced) > len(beyond))
    better = _where(findings, "better than the paper")
    less = f" (less {_on(better)})" * bool(better)
    return f"{less}{f', at tensions no tendon bears{where}' * bool(beyond)}"


def _ranking(claims: Sequence[Judgement], loops: Sequence[str]) -> list[str]:
    """SMC against PID, and the whole order of T2 with our designs of what the paper only names."""
    from wristctl.comparison.paper import T2

    pairs = []
    for gains, wording in (("printed", "with the paper's gains"), ("exchanged", "with P1 and P2 exchanged")):
        one = _one(j for j in claims if _is_order(j.claim, f"smc/{gains}", "pid/printed"))
        pairs += [f"{_places(one.found)} {wording}"] if one else []
    sentences = [f"SMC has a smaller RMSE than PID {'; '.join(pairs)}."] if pairs else []
    order = sorted(T2, key=lambda name: T2[name].rmse)
    links = [_one(j for j in claims if _is_order(j.claim, f"{a}/", f"{b}/")) for a, b in pairwise(order)]
    tried = [link.found for link in links if link is not None]
    if len(tried) < len(links):
        return sentences
    named = [name.upper() for name in order if name not in ("smc", "pid")]
    verdicts = {loop: {f[loop].beside or f[loop].verdict if loop in f else None for f in tried} for loop in loops}
    holds = [loop for loop in loops if verdicts[loop] <= {"reproduced"}]
    return [
        *sentences,
        f"The paper's ranking ({', '.join(name.upper() for name in order)}) cannot be tested without equations of "
        f"{joined(named)}; with our designs, and P1 and P2 exchanged, it holds {_on(holds, loops)}.",
    ]


def _softened(claims: Sequence[Judgement]) -> list[str]:
    """Whether springs that lost stiffness add as much error as the experiment has, by the heaviest claim of that."""
    found = [j for j in claims if j.claim.stiffness_scale < 1.0 and j.claim.weight and j.claim.value]
    return [
        f"{capital(_places(j.found))} springs of {_percent(j.claim.stiffness_scale)} stiffness (ours) add the "
        f"paper's {degrees(float(j.claim.value or 0.0))} deg."
        for j in found[:1]
    ]


def _is_order(claim: Claim, less: str, more: str) -> bool:
    """Whether it says that the RMSE of the one, which begins so, is less than that of the other."""
    return (
        (claim.evidence, claim.metric) == ("ordering", "rmse")
        and claim.label.startswith(less)
        and str(claim.than).startswith(more)
    )


# Gains in few words, after "with".
_SHORT = {
    "smc/printed": "SMC as printed",
    "smc/exchanged": "SMC with P1 and P2 exchanged",
    "pid/printed": "PID as printed",
}


def _over_the_box(strips: Sequence[Strip]) -> list[str]:
    """In which share of the settings that the paper may have had gains arrive, and give a whole row of T2."""
    from wristctl.comparison.paper import FACTOR

    told = ("arrival", "together")
    in_box = {evidence: [strip for strip in strips if strip.claim.evidence == evidence] for evidence in told}
    used = [strip for parts in in_box.values() for strip in parts]
    if not used:
        return []

    def shares(evidence: str) -> str:
        held = [(strip.claim.label, strip.share("reproduced")) for strip in in_box[evidence]]
        told = [(label, _percent(share.value) if share.n else "no setting that converged") for label, share in held]
        return joined([f"{_SHORT.get(label, label)} in {percent}" for label, percent in told])

    sentences = []
    if in_box["arrival"]:
        resting = any(strip.share("reproduced").times for strip in in_box["arrival"])
        also = " (also by wrists that rest there whatever is asked of them)" * resting
        sentences.append(f"30 deg are reached with {shares('arrival')}{also}")
    if in_box["together"]:
        sentences.append(
            f"all three numbers of Table 2 come out at once, within a factor of {FACTOR:g}, with {shares('together')}"
        )
    left = sorted({strip.uncounted for strip in used})
    many = f"{left[0]} to {left[-1]}" if len(left) > 1 else f"{left[0]}"
    open_ = f" ({many} did not converge and are not counted)" * bool(left[-1])
    return [f"Of {len(strips[0].verdicts)} settings that the paper may have had{open_} {'; '.join(sentences)}."]


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
            f"Of {len(best)} ways to train its networks (it does not say which) sigmoid is shown to be the "
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
        ("contradicted", "The paper's own equations or words contradict"),
        ("not specified enough", "The paper says too little to test"),
    ):
        topics = [j.claim.topic for j in topical if j.verdict == verdict and not j.claim.part_of]
        if topics:
            sentences.append(f"{begin}: {', '.join(topics)}.")
    return sentences


# Subjects of the claims that want an earlier run.
_RUNS = {"table1": "networks", "selection": "their depth", "hardware": "the experiment"}


def _untested(claims: Sequence[Judgement]) -> list[str]:
    wanted = {j.claim.evidence for j in claims if j.verdict == "open"}
    missing = [f"{subject} (--{name} RUN)" for name, subject in _RUNS.items() if name in wanted]
    return [f"Not tested: {', '.join(missing)}."] if missing else []


def _numbers(claims: Sequence[Judgement], loops: Sequence[str], most: int) -> Table | None:
    """The heaviest claims with the paper's number, ours on each loop, and on which loops they agree."""
    from wristctl.comparison.paper import FACTOR

    heavy = sorted((j for j in claims if j.claim.weight and j.claim.value), key=lambda j: -j.claim.weight)[:most]
    if not heavy or not loops:
        return None
    units, rows = {_unit(j.claim) for j in heavy}, []
    for j in heavy:
        found = [j.found.get(name) for name in loops]
        ours = [_range(j.claim, one.low, one.high) if one else "not tried" for one in found]
        unit = f" [{_unit(j.claim)}]" * (len(units) > 1 and bool(_unit(j.claim)))
        value = float(j.claim.value or 0.0)
        paper = _range(j.claim, value, value)
        tried, holding = [name for name in j.found if name], _where(j.found, "reproduced")
        agree = "all loops" if len(holding) == len(tried) else ", ".join(map(_word, holding)) or "no loop"
        rows.append(((j.claim.topic or j.claim.says) + unit, paper, *ours, agree))
    common = f" [{min(units)}]" if len(units) == 1 and min(units) else ""
    rule = f"the range overlaps paper / {FACTOR:g} to paper x {FACTOR:g}"
    return Table(
        f"Errors{common}, from one move to the other; agrees: {rule}",
        ("quantity", "paper", *map(_word, loops), "agrees on"),
        rows,
    )


def _unit(claim: Claim) -> str:
    """Unit for people: angles are in degrees."""
    return "deg" if claim.unit == "rad" else claim.unit


def _range(claim: Claim, low: float, high: float) -> str:
    from wristctl.comparison.claims import interval

    if math.isnan(low):
        return "fails"
    if claim.unit != "rad":
        return interval(low, high)
    return " to ".join(dict.fromkeys((degrees(low), degrees(high))))


def _places(findings: Mapping[str, Finding]) -> str:
    """On which loops something is so, on which for some motions only, and on which two are alike."""
    loops, open_ = [name for name in findings if name], _where(findings, _OPEN)
    alike = [name for name in open_ if findings[name].reason.startswith("alike")]
    some = [name for name in open_ if name not in alike]
    holding = _where(findings, "reproduced")
    places = [_on(holding, () if some else loops)] * bool(holding or not some)
    places += [f"in one of two moves {_on(some, () if holding else loops)}"] * bool(some)
    places += [f"with equal errors {_on(alike)}"] * bool(alike)
    return ", ".join(places)


def _on(holding: Sequence[str], loops: Iterable[str] = ()) -> str:
    """Loops in words: on all `loops`, on no loop, on the ideal loop only, on the ideal and 1 kHz loops."""
    tried = [name for name in loops if name]
    if len(holding) == len(tried) > 1:
        return "on all loops"
    only = " only" * (len(tried) > 1 == len(holding))
    return f"on the {joined([*map(_word, holding)])} loop{'s' * (len(holding) > 1)}{only}" if holding else "on no loop"


def _where(findings: Mapping[str, Finding], verdict: str) -> list[str]:
    return [name for name, finding in findings.items() if name and finding.verdict == verdict]


def _one(judged: Iterable[Judgement]) -> Judgement | None:
    """The first that was tried on loops."""
    return next((judgement for judgement in judged if any(name for name in judgement.found)), None)


def _percent(share: float) -> str:
    """Two digits; 0 and 100 % are none and all, and nothing else is."""
    percent = 100.0 * share
    return f"{min(percent, 99.0) if share < 1.0 else percent:.0f} %" if percent >= 10.0 else f"{percent:.2g} %"
