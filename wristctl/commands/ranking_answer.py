"""Rankings for people: which controller to use where, every controller under each condition, and how sure that is.

`compare` says so of its conditions, `study` of its families of worlds.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from itertools import chain

from wristctl.commands.printed_table import degrees, joined, two
from wristctl.comparison.combinations import class_of
from wristctl.comparison.controller_ranking import MOTORS_DECIDE, Fault, Ranking, Traits, labels_of, traits_of
from wristctl.comparison.model_confidence_set import LEAST_PAIRS
from wristctl.config.loop import Loop
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller
from wristctl.tuning.objective import YARDSTICK

# Names of gains that the paper prints, and of those with P1 and P2 exchanged: never left out of a label.
PRINTED = "printed"
PAPERS_GAINS = {PRINTED, "exchanged"}
# Digits of an error and of a ratio of errors: everywhere the same.
DIGITS = 3
# Letters of a name, at most.
_LETTERS = 24
# Controllers, ties and conditions that a sentence names; of more it gives the number.
_NAMED = 3


def condition(ranking: Ranking) -> str:
    """A condition in a few words; of worlds the name of their family."""
    if ranking.unit == "world":
        return ranking.name.replace(", steps", " (steps)")
    words = class_words(ranking.name.removesuffix(", steps"), ranking.traits)
    return f"{words} (steps)" if ranking.jumps else words


def class_words(name: str, traits: Traits) -> str:
    """A class of loops in a few words, as tables have it."""
    if name == "camera and tendons":
        return _rig(traits, " + ")
    words = {"pushed": "push", "off-nominal": "wrong model"}.get(name, name)
    return f"{_rig(traits, ' + ')} + {words}" if traits.rig else words


def condition_of_loop(loop: Loop, wrist: WristParameters) -> str:
    """The condition that `compare` ranks a loop under, in the words of its tables."""
    return class_words(class_of(loop, wrist), traits_of([loop], wrist))


def _rig(traits: Traits, between: str = " and ") -> str:
    """What is simulated of a rig."""
    if traits.camera == traits.tendons:
        return f"motors{between if traits.camera else ' or '}camera"
    return "camera" if traits.camera else "motors"


def names_of(rankings: Sequence[Ranking]) -> dict[str, str]:
    """Name of each row: its label, without gains where all that are not the paper's are the same, or none matter.

    Beside a row that is named alone, as its preset is that of each loop, labels stay whole.
    """
    labels = labels_of(rankings)
    if any(map(is_by_loop, labels)):
        return _shortened({label: called(label) for label in labels})
    ours = {label.partition("/")[2] for label in labels if not open_loop(label)} - PAPERS_GAINS
    names = {}
    for label in labels:
        name, _, gains = label.partition("/")
        names[label] = name if open_loop(label) or (len(ours) == 1 and gains in ours) else label
    return _shortened(names)


def _shortened(names: Mapping[str, str]) -> dict[str, str]:
    """Names by label, cut where they are long: at the end, else in the middle, else not, so that all differ."""
    begins = {label: f"{name[: _LETTERS - 1]}~" for label, name in names.items()}
    middles = {label: f"{name[:7]}~{name[8 - _LETTERS :]}" for label, name in names.items()}
    shown = {}
    for label, name in names.items():
        tries = [cut[label] for cut in (begins, middles) if Counter(cut.values())[cut[label]] == 1]
        shown[label] = name if len(name) <= _LETTERS or not tries else tries[0]
    return shown


def gains_words(name: str, gains: Mapping[str, float]) -> str:
    """Gains of a controller with their units: Kp = 4672 N m/rad, Kd = 0.02105 N m s/rad."""
    table = controller(name).gains
    return ", ".join(f"{gain} = {value:.4g} {table[gain].unit}".rstrip() for gain, value in gains.items())


def called(label: str) -> str:
    """A controller with its gains; feedforward has none."""
    return label.split("/")[0] if open_loop(label) else label


def open_loop(label: str) -> bool:
    """Whether a label is of the controller without feedback."""
    return label.split("/")[0] == YARDSTICK


def is_by_loop(label: str) -> bool:
    """Whether a label is of a controller that is named alone, whose preset is that of each loop."""
    return "/" not in label


def winner(ranking: Ranking, rankings: Sequence[Ranking] = ()) -> int | None:
    """The first row of the first group; of those with the same error the one that most other rankings have in theirs.

    None where nothing is ranked.
    """
    if not ranking.standing.groups:
        return None
    first = ranking.standing.groups[0]
    least = ranking.means[first[0]].value
    equal = [row for row in first if ranking.means[row].value <= least * (1.0 + 1e-9)]
    often = Counter(label for other in rankings for label in first_group(other))
    return max(equal, key=lambda row: (often[ranking.labels[row]], -first.index(row)))


def first_group(ranking: Ranking) -> list[str]:
    """Labels of the best controllers, which cannot be told apart; none where nothing is ranked."""
    return [ranking.labels[row] for row in ranking.standing.groups[0]] if ranking.standing.groups else []


def error(ranking: Ranking, row: int) -> str:
    """Geometric mean of a row's RMSE [deg]."""
    return degrees(ranking.means[row].value, DIGITS)


def with_interval(ranking: Ranking, row: int) -> str:
    """A row's RMSE [deg] with the ends of its 95 % interval in brackets, if it has one."""
    mean = ranking.means[row]
    if not (math.isfinite(mean.high) and mean.high > mean.low):
        return error(ranking, row)
    return f"{error(ranking, row)} [{degrees(mean.low)}, {degrees(mean.high)}]"


# Size of a fault in people's units, by its kind; others have none.
_SIZES: dict[str, Callable[[float], str]] = {
    "swings": lambda size: f"{two(math.degrees(size))} deg",
    "chatters": lambda size: f"{two(size)}/s",
    "pulls": lambda size: f"{two(size)} N",
}


def fault_words(fault: Fault, unit: bool = True) -> str:
    """A fault with its size, a swing's from peak to peak, and in how many cases: swings 2.7 deg in 7 of 8."""
    size = _SIZES[fault.kind](fault.size) if fault.size else ""
    size += " peak to peak" * (bool(size) and unit and fault.kind == "swings")
    return " ".join(filter(None, [fault.kind, size, f"in {fault.times} of {fault.of}", fault.unit * unit]))


def advice(rankings: Sequence[Ranking]) -> str:
    """Which controller to use: of conditions with motors or a camera, and of ideal ones; of smooth motions, if any."""
    told = []
    for alike in _sides(rankings):
        where = "With exact angles and torques"
        if alike[0].traits.rig:
            camera, tendons = (all(getattr(one.traits, part) for one in alike) for part in ("camera", "tendons"))
            parts = {(True, False): "a simulated camera", (False, True): "simulated motors and tendons"}
            both = f"simulated motors, tendons {'and' if camera else 'or'} a camera"
            where = f"With {parts.get((camera, tendons), both)}"
        where = f"For steps {where[0].lower()}{where[1:]}" if alike[0].jumps else where
        told.append(_use(where, alike, [ranking for ranking in rankings if ranking not in alike]))
    return " ".join(told)


def recommended(rankings: Sequence[Ranking]) -> list[str]:
    """Labels that `advice` says to use, each once: with motors or a camera, then in ideal conditions."""
    chosen = [_chosen(alike) for alike in _sides(rankings)]
    return list(dict.fromkeys(label for label in chosen if label is not None))


def _sides(rankings: Sequence[Ranking]) -> list[list[Ranking]]:
    """Rankings of smooth motions, or where all jump of steps: those with motors or a camera, and ideal ones."""
    spoken = [ranking for ranking in rankings if not ranking.jumps] or rankings
    sides = [[ranking for ranking in spoken if ranking.traits.rig == rig] for rig in (True, False)]
    return [alike for alike in sides if alike]


def led(rankings: Sequence[Ranking]) -> list[Ranking]:
    """Rankings in the order in which `advice` speaks of them: those where what it says to use is best come first."""
    told = list[Ranking]()
    for alike in _sides(rankings):
        chosen = _chosen(alike)
        told += sorted(alike, key=lambda ranking: chosen not in first_group(ranking))
    return [*told, *(ranking for ranking in rankings if ranking not in told)]


def _chosen(alike: Sequence[Ranking]) -> str | None:
    """The controller that is among the best in most of these rankings; of those, that with the least error there."""
    often = Counter(label for ranking in alike for label in first_group(ranking))
    firsts = {ranking.labels[row] for ranking in alike if (row := winner(ranking, alike)) is not None}

    def mean(label: str) -> float:
        return sum(math.log(one.of_label(label).value) for one in alike if label in one.labels)

    return max(sorted(firsts), key=lambda label: (often[label], -mean(label)), default=None)


def _use(where: str, alike: Sequence[Ranking], others: Sequence[Ranking]) -> str:
    """What to use in conditions of one kind, its error, and by how much it is better; then what limits that."""
    chosen = _chosen(alike)
    if chosen is None:
        return f"{where}, {_no_ranking(alike)}."
    best = [ranking for ranking in alike if chosen in first_group(ranking)]
    places = joined([condition(ranking).removesuffix(" (steps)") for ranking in best])
    alone = f" ({places})" * (len(alike) > 1)
    text = f"{where}{alone}, use {called(chosen)}: RMSE {_errors(best, chosen)}{_than_the_next(best, chosen)}."
    return " ".join(filter(None, [text, _ties(best, chosen), *_limits(chosen, best, alike, others)]))


def _errors(best: Sequence[Ranking], label: str) -> str:
    """Error of a controller: with its interval in one condition, from the least to the largest over several."""
    if len(best) == 1:
        text = with_interval(best[0], best[0].labels.index(label))
        return text.replace(" [", " deg [") if "[" in text else f"{text} deg"
    means = sorted(ranking.of_label(label).value for ranking in best)
    least, most = degrees(means[0], DIGITS), degrees(means[-1], DIGITS)
    return f"{least} deg" if least == most else f"{least} to {most} deg"


def _than_the_next(best: Sequence[Ranking], label: str) -> str:
    """By how much the error is less than that of the next that is told from it: the least over the conditions."""
    if any(len(ranking.standing.groups) < 2 for ranking in best):
        return ""
    nexts = [ranking.standing.groups[1][0] for ranking in best]
    own = [ranking.of_label(label).value for ranking in best]
    ratios = [one.means[row].value / mean for one, row, mean in zip(best, nexts, own, strict=True)]
    place = min(range(len(best)), key=lambda number: ratios[number])
    bound = "more than " if degrees(own[place]).startswith("<") else "at least " * (len(best) > 1)
    following = called(best[place].labels[nexts[place]])
    return f", {bound}{two(ratios[place], DIGITS)} times less than {following}, the next"


def _ties(best: Sequence[Ranking], chosen: str) -> str:
    """What is as good everywhere; feedforward first, since it needs no sensor."""
    if open_loop(chosen):
        return "No controller is better than feedforward, which has no feedback."
    tied = [one for one in first_group(best[0]) if one != chosen and all(one in first_group(other) for other in best)]
    tied.sort(key=lambda label: not open_loop(label))
    if not tied:
        return ""
    names = [called(label) for label in tied]
    names = names if len(names) <= _NAMED else [*names[: _NAMED - 1], f"{len(names) - _NAMED + 1} more"]
    return f"{joined([f'{names[0]} (without feedback)', *names[1:]] if open_loop(tied[0]) else names)} " + (
        "ties with it." if len(tied) == 1 else "tie with it."
    )


def _limits(chosen: str, best: Sequence[Ranking], alike: Sequence[Ranking], others: Sequence[Ranking]) -> list[str]:
    """Where a controller must not be used, where another is better, and what is not known."""
    bad = {
        condition(ranking): ranking.fault(ranking.labels.index(chosen))
        for ranking in [*alike, *others]
        if chosen in ranking.labels and ranking.labels.index(chosen) in ranking.standing.unusable
    }
    told = []
    if bad:
        (first, fault), places = next(iter(bad.items())), _counted(list(bad))
        there = f" ({first})" * (len(bad) > 1)
        told.append(f"Do not use {called(chosen)} in {places}: it {fault_words(fault)}{there}." if fault else "")
    better = [one for one in alike if one.standing.groups and one not in best and condition(one) not in bad]
    if len(better) == 1:
        (only,) = better
        told.append(f"In {condition(only)} use {called(only.labels[only.standing.groups[0][0]])}.")
    elif better:
        told.append(f"Others are better in {_counted([condition(one) for one in better])}.")
    seldom = [fault for one in best if (fault := one.fault(one.labels.index(chosen))) is not None]
    if seldom:
        told.append(f"Even so it {fault_words(max(seldom, key=lambda fault: fault.times / fault.of))}.")
    if few := [condition(ranking) for ranking in alike if ranking.standing.untold]:
        told.append(f"There is no ranking in {_counted(few)}: too few cases.")
    return told


def _counted(places: Sequence[str]) -> str:
    shown = places if len(places) <= _NAMED else [*places[: _NAMED - 1], f"{len(places) - _NAMED + 1} more"]
    return joined(shown)


def _no_ranking(alike: Sequence[Ranking]) -> str:
    few = [ranking for ranking in alike if ranking.standing.untold]
    if not few:
        return "use none of these: each fails, swings, chatters or does not arrive"
    fewest = min(few, key=lambda ranking: ranking.count)
    least = min(fewest.standing.untold, key=lambda row: fewest.means[row].value)
    lowest = f"{called(fewest.labels[least])} has the least RMSE, {error(fewest, least)} deg"
    return f"there is no ranking: too few cases ({fewest.cases}, {LEAST_PAIRS} are needed). {lowest}"


def not_to_use(rankings: Sequence[Ranking], names: Mapping[str, str]) -> str:
    """Controllers that must not be used in each condition of smooth motions; why, says the table."""
    spoken = [ranking for side in _sides(rankings) for ranking in side]
    places: dict[tuple[str, ...], list[str]] = {}
    for ranking in spoken:
        bad = tuple(names[ranking.labels[row]] for row in ranking.standing.unusable)
        places.setdefault(bad, []).append(condition(ranking))
    if not any(places):
        return "Every controller here can be used."
    listed = [
        f"in {joined(where)} {joined(bad) if len(bad) <= 2 * _NAMED else f'{len(bad)} controllers'}"
        for bad, where in places.items()
        if bad
    ]
    return f"Do not use: {'; '.join(listed)}."


def certainty(rankings: Sequence[Ranking]) -> str:
    """By how much errors must differ to be told apart, with 95 %."""
    floors = sorted(floor for one in rankings if one.standing.groups and 1.0 < (floor := one.standing.floor) < math.inf)
    if not floors:
        return ""
    ends = [f"{two(100.0 * (floor - 1.0))} %" if floor < 2.0 else f"a factor of {two(floor)}" for floor in floors]
    size = ends[0] if ends[0] == ends[-1] else f"{ends[0]} to {ends[-1]}, by condition,"
    return f"RMSE that differ by less than {size} cannot be told apart with 95 %; {rankings[0].more} can."


def paired(rankings: Sequence[Ranking]) -> str:
    """Why a row may be told from the best although their intervals overlap; empty where no row of these is."""
    for ranking in rankings:
        best = winner(ranking, rankings)
        told = chain.from_iterable(ranking.standing.groups[1:])
        if best is not None and any(ranking.means[row].low <= ranking.means[best].high for row in told):
            return f"Rows are compared in pairs on the same {ranking.unit}s: some differ whose intervals overlap."
    return ""


def decided(rankings: Sequence[Ranking]) -> str:
    """How long the best wait for their motors or tensions, and where motors make several of them alike.

    Where none can be used it is told of the one with the least error.
    """
    shares, motors = list[str](), list[str]()
    known = [ranking for ranking in rankings if ranking.at_limit]
    for ranking in known:
        row = winner(ranking, rankings)
        row = ranking.standing.order[0] if row is None else row
        where = f"{condition(ranking)} " if len(rankings) > 1 else ""
        told = [f"{limit} {two(100.0 * of_rows[row])} %" for limit, of_rows in ranking.at_limit.items()]
        shares += [f"{where}{', '.join(told)}"] * any(of_rows[row] > 0.0 for of_rows in ranking.at_limit.values())
        motors += [condition(ranking)] * ranking.motors_decide
    if not known:
        return ""
    text = f"Share of time at a limit, of the best: {'; '.join(shares) or 'none'}."
    if not motors:
        return text
    where = f"In {joined(motors)} motors" if len(rankings) > 1 else "There motors"
    return f"{text} {where} decide: all of the best wait for theirs {100.0 * MOTORS_DECIDE:g} % of the time or more."
