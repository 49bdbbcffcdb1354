"""Rankings in words: which controller to use where, what must not be used and why, and how sure that is.

`compare` says so of its conditions, `study` of its families of worlds.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from wristctl.commands.answer import LINES, Answer
from wristctl.commands.printed_table import COLUMNS, Table, degrees, joined, two
from wristctl.commands.ranking_words import (
    DIGITS,
    between,
    called,
    condition,
    counted_in,
    error,
    fact,
    facts,
    fault_size,
    first_group,
    interval,
    open_loop,
    rig_whole,
    sized,
    winner,
)

if TYPE_CHECKING:
    from wristctl.comparison.controller_ranking import Ranking


def advice(rankings: Sequence[Ranking]) -> str:
    """Which controller to use: a sentence for conditions with motors or a camera, and one for ideal ones.

    It is of smooth motions; where all jump, of steps.
    """
    sides = _sides(rankings)
    sentences = []
    for rig, alike in sides.items():
        where = f"with {rig_whole(alike, simulated=True) if rig else 'exact angles and torques'}"
        where = f"For steps {where}" if alike[0].jumps else capital(where)
        sentences.append(_use(where, alike, [ranking for ranking in rankings if ranking not in alike]))
    return " ".join(sentences)


def recommended(rankings: Sequence[Ranking]) -> list[str]:
    """Labels that `advice` names first, each once: with motors or a camera, then in ideal conditions."""
    sides = [[one for one in alike if one.standing.groups] for alike in _sides(rankings).values()]
    return list(dict.fromkeys(_chosen(ranked)[0] for ranked in sides if ranked))


def _sides(rankings: Sequence[Ranking]) -> dict[bool, list[Ranking]]:
    """Rankings of smooth motions, or where all jump of steps: with motors or a camera, and ideal ones."""
    spoken = [ranking for ranking in rankings if not ranking.jumps] or rankings
    sides = {rig: [ranking for ranking in spoken if ranking.traits.rig == rig] for rig in (True, False)}
    return {rig: alike for rig, alike in sides.items() if alike}


def _chosen(ranked: Sequence[Ranking]) -> tuple[str, Counter[str]]:
    """The controller that is best in most of these rankings, and how often any is among the best."""
    often = Counter(label for ranking in ranked for label in first_group(ranking))
    firsts = {ranking.labels[row] for ranking in ranked if (row := winner(ranking, ranked)) is not None}
    return max(sorted(firsts), key=lambda label: (often[label], -_mean(ranked, label))), often


def _use(where: str, alike: Sequence[Ranking], others: Sequence[Ranking]) -> str:
    """What to use in conditions of one kind, how large its error is there, and where it must not be used."""
    ranked = [ranking for ranking in alike if ranking.standing.groups]
    if not ranked:
        return f"{where}, {_no_ranking(alike)}."
    chosen, often = _chosen(ranked)
    places = [(ranking, ranking.labels.index(chosen)) for ranking in ranked if chosen in ranking.labels]
    places = [place for place in places if place[0].standing.group(place[1]) == 1]
    errors = sorted(((ranking.means[row].value, condition(ranking)) for ranking, row in places))
    equal = [label for label, times in often.items() if times == often[chosen] == len(ranked) and label != chosen]
    alternatives = equal if len(equal) <= 3 else []
    everywhere = len(places) == len(alike) > 1
    names = f" ({', '.join(map(condition, alike))})" if everywhere else ""
    text = f"{where}{names}, use {called(chosen)}: RMSE {_errors(errors)}"
    if len(places) == 1:
        text += interval(*places[0])
    if len(alike) > 1 and not everywhere:
        text += f", the best in {joined([condition(ranking) for ranking, _ in places])}"
    following = _than_the_next(places)
    text += following
    compared = [place for place in places if place[0].yardstick not in place[0].standing.unusable]
    gains = sorted(ranking.gains[row].value for ranking, row in compared if math.isfinite(ranking.gains[row].value))
    if any(map(open_loop, (chosen, *equal))):
        text += "; no controller is better than feedforward, which is open loop"
    elif gains:
        least = _times(gains[0], errors[0][0], several=len(gains) > 1)
        text += f",{' and' if following else ''} {least} lower than feedforward"
    if equal:
        as_good = joined([*map(called, alternatives)]) or f"{len(equal)} others"
        text += f"; {as_good} {'ties' if len(equal) == 1 else 'tie'} with it"
    best_in = [ranking for ranking, _ in places]
    rest = [ranking for ranking in ranked if ranking not in best_in]
    text += _elsewhere(chosen, rest)
    text += _seldom([chosen, *alternatives], best_in)
    if few := [condition(ranking) for ranking in alike if ranking.standing.untold]:
        text += f" (no ranking in {joined(few)}: too few cases)"
    told = [*best_in, *(rest if len(rest) <= _TOLD else [])]
    untold = [ranking for ranking in (*alike, *others) if ranking not in told]
    return f"{text}{_where_not(chosen, untold, on_a_rig=alike[0].traits.rig)}."


def _than_the_next(places: Sequence[tuple[Ranking, int]]) -> str:
    """By how much the error is lower than that of the next: the least of the conditions in which they differ.

    The next is, of those that come second in some condition, the one with the least error over all of them.
    """
    if any(len(ranking.standing.groups) < 2 for ranking, _ in places):
        return ""
    rankings = [ranking for ranking, _ in places]
    seconds = sorted({ranking.labels[ranking.standing.groups[1][0]] for ranking in rankings})
    following = min(seconds, key=lambda label: _mean(rankings, label))
    ratios, where = [], []
    for ranking, row in places:
        after = ranking.labels.index(following) if following in ranking.labels else row
        if (ranking.standing.group(after) or 1) > 1:
            ratios.append((ranking.means[after].value / ranking.means[row].value, ranking.means[row].value))
            where.append(condition(ranking))
    ratio, rmse = min(ratios)
    in_some = f" (in {joined(where)})" if len(where) < len(places) else ""
    return f", {_times(ratio, rmse, several=len(where) > 1)} lower than {called(following)}, the next{in_some}"


# Conditions of which it is told by how much another controller is better there.
_TOLD = 2


def _elsewhere(chosen: str, others: Sequence[Ranking]) -> str:
    """In which other conditions of the same kind not to use a controller: what it does there, and what is better."""
    if len(others) > _TOLD:
        sound = [condition(ranking) for ranking in others if not _must_not(chosen, ranking)]
        return f"; others are better in {joined(sound)}" if sound else ""
    text = ""
    for ranking in others:
        first = ranking.standing.groups[0][0]
        better = called(ranking.labels[first])
        row = ranking.labels.index(chosen) if chosen in ranking.labels else first
        if row in ranking.standing.unusable:
            text += f"; not in {condition(ranking)}, where it {fact(ranking, row)}, and {better} is best"
        elif row != first:
            ratio = _times(ranking.means[row].value / ranking.means[first].value, ranking.means[first].value)
            text += f"; not in {condition(ranking)}, where {better} has {ratio} less"
    return text


def _must_not(label: str, ranking: Ranking) -> bool:
    """Whether a controller must not be used in a condition."""
    return label in ranking.labels and ranking.labels.index(label) in ranking.standing.unusable


def _where_not(chosen: str, rankings: Sequence[Ranking], on_a_rig: bool) -> str:
    """The conditions in which a controller must not be used, and why in the worst of them.

    Where it is chosen for ideal conditions, those with motors or a camera are one.
    """
    bad = [ranking for ranking in rankings if _must_not(chosen, ranking)]
    rigs = [] if on_a_rig else _smooth_on_rigs(bad)
    others = [ranking for ranking in bad if ranking not in rigs]
    text = ""
    for alike in filter(None, (rigs, others)):
        worst = max(alike, key=lambda ranking: _lost(ranking, ranking.labels.index(chosen)))
        where = f"with {rig_whole([worst])}" if alike is rigs else f"in {joined([condition(one) for one in alike])}"
        text += f"; do not use {called(chosen)} {where}: it {fact(worst, worst.labels.index(chosen))}"
        text += f" ({condition(worst)})" if alike is others and len(others) > 1 else ""
    return text


def _seldom(labels: Sequence[str], rankings: Sequence[Ranking]) -> str:
    """Faults of controllers that have them too seldom to be shown to exceed what is tolerated, the worst of each."""
    worst: dict[str, list[tuple[str, Ranking, int]]] = {}
    for label in labels:
        lost = [(ranking, ranking.labels.index(label)) for ranking in rankings if label in ranking.labels]
        ranking, row = max(lost, key=lambda place: _lost(*place))
        if ranking.standing.lost[row].times:
            worst.setdefault(next(iter(facts(ranking, row))), []).append((label, ranking, row))
    return "".join(f"; {_together(verb, places)}" for verb, places in worst.items())


def _together(verb: str, places: Sequence[tuple[str, Ranking, int]]) -> str:
    """A fault that one or several controllers have, with the largest size and number of cases."""
    label, ranking, row = max(places, key=lambda place: _lost(*place[1:]))
    if len(places) == 1:
        return f"{label} {fact(ranking, row)}"
    largest = sized(verb, [max(fault_size(verb, *place[1:]) for place in places)])
    often = max(facts(*place[1:])[verb][1] for place in places)
    words = f"{joined([label for label, *_ in places])} {_THEY[verb]}"
    return f"{words} {f'{largest} at most, ' if largest else ''}in {often} of {counted_in(ranking, verb)} at most"


def _no_ranking(alike: Sequence[Ranking]) -> str:
    from wristctl.comparison.model_confidence_set import LEAST_PAIRS

    few = [ranking for ranking in alike if ranking.standing.untold]
    if not few:
        return "use none of these: each fails, swings, chatters or does not arrive"
    fewest = min(few, key=lambda ranking: ranking.count)
    least = min(fewest.standing.untold, key=lambda row: fewest.means[row].value)
    lowest = f"{called(fewest.labels[least])} has the least RMSE, {error(fewest, least)} deg"
    return f"there is no ranking: too few cases ({fewest.cases}, {LEAST_PAIRS} are needed). {lowest}"


def _errors(errors: Sequence[tuple[float, str]]) -> str:
    """Sorted errors [rad] of conditions: one, or the least and the largest with where they are."""
    shown = [degrees(rmse, DIGITS) for rmse, _ in errors]
    if shown[0] == shown[-1]:
        return f"{shown[0]} deg"
    return f"{shown[0]} ({errors[0][1]}) to {shown[-1]} deg ({errors[-1][1]})"


def _times(least: float, rmse: float, several: bool = False) -> str:
    """The least of one or `several` ratios of errors in words; of an RMSE that nobody could measure it is a bound."""
    bound = "more than " if degrees(rmse).startswith("<") else "at least " * several
    return f"{bound}{two(least, DIGITS)} times"


def _mean(rankings: Sequence[Ranking], label: str) -> float:
    """Mean of the logarithm of a row's RMSE over the rankings that it is in."""
    means = [ranking.means[ranking.labels.index(label)].value for ranking in rankings if label in ranking.labels]
    return sum(map(math.log, means)) / len(means)


def ties(rankings: Sequence[Ranking], names: Mapping[str, str]) -> str:
    """Every controller that ties with the best of a condition; conditions with the same ones together."""
    same: dict[tuple[str, ...], list[str]] = {}
    for ranking in rankings:
        row = winner(ranking, rankings)
        if row is not None and len(ranking.standing.groups[0]) > 1:
            others = tuple(names[ranking.labels[other]] for other in ranking.standing.groups[0] if other != row)
            same.setdefault(others, []).append(condition(ranking))
    listed = [f"{joined(where)}: {', '.join(others)}" for others, where in same.items()]
    listing = ". ".join(capital(one) for one in listed)
    return f"Tied with the best, as paired tests at 95 % do not tell them apart. {listing}." if listed else ""


def capital(text: str) -> str:
    """A text that begins a sentence."""
    return text[:1].upper() + text[1:]


def do_not_use(rankings: Sequence[Ranking], names: Mapping[str, str]) -> str:
    """Every controller that must not be used with motors, tendons and a camera, and why.

    Where no condition has them, of all conditions. A row that is bad in several conditions is told for the worst.
    """
    where, worst = _unusable(rankings)
    if not worst:
        return f"Every controller here can be used{where}."
    several = len(_smooth_on_rigs(rankings) or rankings) > 1
    by_verb: dict[str, list[tuple[str, str]]] = {}
    for label, (ranking, row) in worst.items():
        verb, (size, count) = next(iter(facts(ranking, row).items()))
        place = f", {condition(ranking)}" if several else ""
        by_verb.setdefault(verb, []).append(
            (f"{names[label]} {size}".rstrip(), f"in {count} of {counted_in(ranking, verb)}{place}")
        )
    sentences = []
    for verb, rows in by_verb.items():
        counts = list(dict.fromkeys(count for _, count in rows))
        if len(counts) == 1:
            text = f"{joined([name for name, _ in rows])} ({'each ' * (len(rows) > 1)}{counts[0]})"
        else:
            text = joined([f"{name} ({count})" for name, count in rows])
        sentences.append(f"that {_THEY[verb]}: {text}")
    return f"{capital(f'{where}, do not use'.strip(' ,'))} controllers {'; '.join(sentences)}."


def do_not_use_briefly(rankings: Sequence[Ranking], names: Mapping[str, str]) -> str:
    """The names of `do_not_use` alone, of many the first and the number of the others; empty without any."""
    where, worst = _unusable(rankings)
    if not worst:
        return ""
    first = [names[label] for label in worst][: _NAMED if len(worst) > _NAMED + 1 else None]
    listed = [*first, *([f"{len(worst) - len(first)} more"] if len(worst) > len(first) else [])]
    return f"{capital(f'{where}, do not use'.strip(' ,'))} {joined(listed)}: `--all` says why."


# Controllers that must not be used of which the names are told where the reasons have no room.
_NAMED = 5


def _unusable(rankings: Sequence[Ranking]) -> tuple[str, dict[str, tuple[Ranking, int]]]:
    """Where controllers must not be used, and the worst place and row of each by its label, the largest swing first.

    That is with motors, tendons and a camera; where no condition has them, in all conditions.
    """
    rigs = _smooth_on_rigs(rankings)
    alone = len(rigs) == 1 and rigs[0].unit == "case"
    where = f" in {condition(rigs[0])}" if alone else f" with {rig_whole(rigs)}" if rigs else ""
    worst: dict[str, tuple[Ranking, int]] = {}
    for ranking in rigs or rankings:
        for row in ranking.standing.unusable:
            before = worst.get(ranking.labels[row])
            if before is None or _lost(ranking, row) > _lost(*before):
                worst[ranking.labels[row]] = (ranking, row)
    return where, dict(sorted(worst.items(), key=lambda item: -item[1][0].swing[item[1][1]]))


def _smooth_on_rigs(rankings: Sequence[Ranking]) -> list[Ranking]:
    return [ranking for ranking in rankings if ranking.traits.rig and not ranking.jumps]


def not_elsewhere(rankings: Sequence[Ranking], names: Mapping[str, str]) -> str:
    """Those that must not be used in conditions that `do_not_use` does not tell of, and why; alike ones together."""
    rigs = _smooth_on_rigs(rankings)
    others = [ranking for ranking in rankings if ranking not in rigs] if rigs else []
    faults: dict[str, dict[str, list[Ranking]]] = {}
    for ranking in others:
        for row in ranking.standing.unusable:
            verb = next(iter(facts(ranking, row)))
            faults.setdefault(ranking.labels[row], {}).setdefault(verb, []).append(ranking)
    alike: dict[tuple[tuple[str, str], ...], list[str]] = {}
    for label, places in faults.items():
        where = tuple((verb, joined([condition(one) for one in among])) for verb, among in places.items())
        alike.setdefault(where, []).append(label)
    listed = []
    for where, labels in alike.items():
        clauses = []
        for verb, places_named in where:
            lost = [fault_size(verb, one, one.labels.index(label)) for label in labels for one in faults[label][verb]]
            they = _THEY[verb] if len(labels) > 1 else verb
            clauses.append(" ".join(filter(None, [they, sized(verb, lost), f"in {places_named}"])))
        listed.append(f"{joined([names[label] for label in labels])} {joined(clauses)}")
    return f"In other conditions {'; '.join(listed)}." if listed else ""


def _lost(ranking: Ranking, row: int) -> float:
    return ranking.standing.lost[row].value


# Ratio of two errors from which it is told as a factor, and of two resolutions up to which they are told as a range.
_FACTOR, _ALIKE = 2.0, 5.0
# Faults as verbs of several.
_THEY = {
    "leaves its range": "leave their range",
    "swings": "swing",
    "chatters": "chatter",
    "swings or chatters": "swing or chatter",
    "does not arrive": "do not arrive",
    "pulls harder than a tendon bears": "pull harder than a tendon bears",
    "changes with the integration step": "change with the integration step",
}


def certainty(rankings: Sequence[Ranking]) -> str:
    """By how much errors must differ to be told apart, by condition where that differs much."""
    ranked = {condition(one): one.standing.floor for one in rankings if one.standing.groups}
    floors = {name: floor for name, floor in ranked.items() if 1.0 < floor < math.inf}
    if not floors:
        return ""
    least, most = min(floors.values()), max(floors.values())
    if most - 1.0 <= _ALIKE * (least - 1.0):
        size, rest = between([_apart(least), _apart(most)]), ""
    else:
        size, rest = "this", f": {', '.join(f'{name} {_apart(floor)}' for name, floor in floors.items())}"
    return (
        f"How sure: 95 %. RMSE is a geometric mean over the {rankings[0].unit}s. Controllers whose RMSE differ by less "
        f"than {size} cannot be told apart here{rest}; {rankings[0].more} can."
    )


def _apart(ratio: float) -> str:
    """By how much two errors differ, in words: 12 %, a factor of 4.8."""
    return f"{two(100.0 * (ratio - 1.0))} %" if ratio < _FACTOR else f"a factor of {two(ratio)}"


def fitted(answer: Answer, notes: Sequence[tuple[str | Table, str | Table]]) -> Answer:
    """The answer with as much of its notes as its lines hold: where they are too many, the short forms of the last.

    `notes` are pairs of a note and its short form, which may be empty. Where that is not enough, the columns of the
    table that stand below the others go.
    """
    for shortened in range(len(notes) + 1):
        chosen = [note if place < len(notes) - shortened else short for place, (note, short) in enumerate(notes)]
        whole = replace(answer, notes=[note for note in chosen if note])
        if len(whole.lines()) <= LINES:
            return whole
    return replace(whole, table=whole.table and whole.table.within(COLUMNS))
