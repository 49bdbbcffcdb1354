"""Words of rankings: conditions, controllers with their gains, errors in degrees, and what is wrong with one."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from wristctl.commands.printed_table import degrees, two

if TYPE_CHECKING:
    from wristctl.comparison.controller_ranking import Ranking, Traits

# Names of gains that the paper prints, and of those with P1 and P2 exchanged: never left out of a label.
PRINTED = "printed"
PAPERS_GAINS = {PRINTED, "exchanged"}
# Digits of an error and of a ratio of errors: everywhere the same.
DIGITS = 3
# Letters of a name, at most.
_LETTERS = 24


def condition(ranking: Ranking) -> str:
    """A condition in a few words; of worlds the name of their family."""
    if ranking.unit == "world":
        return ranking.name.replace(", steps", " (steps)")
    words = class_words(ranking.name.removesuffix(", steps"), ranking.traits)
    return f"{words} (steps)" if ranking.jumps else words


def class_words(name: str, traits: Traits) -> str:
    """A class of loops in a few words, as tables have it."""
    if name == "camera and tendons":
        return _rig(traits)
    words = {"pushed": "push", "off-nominal": "wrong model"}.get(name, name)
    return f"{_rig(traits)} + {words}" if traits.rig else words


def _rig(traits: Traits) -> str:
    if traits.camera and traits.tendons:
        return "motors + camera"
    return "camera" if traits.camera else "motors" if traits.tendons else "motors or camera"


def rig_whole(rankings: Sequence[Ranking], simulated: bool = False) -> str:
    """What there is of a rig in these conditions: "a camera", where it is to be said "a simulated camera"."""
    traits = [ranking.traits for ranking in rankings]
    if all(one.camera for one in traits) and not any(one.tendons for one in traits):
        return "a simulated camera" if simulated else "a camera"
    if all(one.tendons for one in traits) and not any(one.camera for one in traits):
        words = "motors and tendons"
    else:
        words = f"motors, tendons {'and' if all(one.camera and one.tendons for one in traits) else 'or'} a camera"
    return f"simulated {words}" if simulated else words


def names_of(rankings: Sequence[Ranking], short: bool = False) -> dict[str, str]:
    """Name of each row: its label, without gains where all that are not the paper's are the same, or none matter.

    With `short` a controller that has one set of gains is its name alone. Beside a row that is named alone, as its
    preset is that of each loop, labels stay whole.
    """
    labels = list(dict.fromkeys(label for ranking in rankings for label in ranking.labels))
    if any(map(is_by_loop, labels)):
        return _shortened({label: called(label) for label in labels})
    ours = {label.partition("/")[2] for label in labels if not open_loop(label)} - PAPERS_GAINS
    controllers = Counter(label.partition("/")[0] for label in labels)
    names = {}
    for label in labels:
        name, _, gains = label.partition("/")
        alone = len(ours) == 1 and gains in ours
        one = short and controllers[name] == 1 and gains != PRINTED
        names[label] = name if open_loop(label) or alone or one else label
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
    from wristctl.control.table import controller

    table = controller(name).gains
    return ", ".join(f"{gain} = {value:.4g} {table[gain].unit}".rstrip() for gain, value in gains.items())


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


def interval(ranking: Ranking, row: int) -> str:
    """The 95 % interval of a row's RMSE in words; empty where there is none."""
    mean = ranking.means[row]
    if not (math.isfinite(mean.high) and mean.high > mean.low):
        return ""
    return f" (95 % interval: {degrees(mean.low, DIGITS)} to {degrees(mean.high, DIGITS)})"


def with_interval(ranking: Ranking, row: int) -> str:
    """A row's RMSE [deg] with the ends of its 95 % interval in brackets, if it has one."""
    mean = ranking.means[row]
    if not (math.isfinite(mean.high) and mean.high > mean.low):
        return error(ranking, row)
    return f"{error(ranking, row)} [{degrees(mean.low)}, {degrees(mean.high)}]"


def called(label: str) -> str:
    """A controller with its gains; feedforward has none."""
    return label.split("/")[0] if open_loop(label) else label


def open_loop(label: str) -> bool:
    """Whether a label is of the controller without feedback."""
    from wristctl.tuning.objective import YARDSTICK

    return label.split("/")[0] == YARDSTICK


def is_by_loop(label: str) -> bool:
    """Whether a label is of a controller that is named alone, whose preset is that of each loop."""
    return "/" not in label


def facts(ranking: Ranking, row: int) -> dict[str, tuple[str, int]]:
    """What is wrong with a row by verb: by how much, and in how many cases; the gravest first."""
    counts = {
        "leaves its range": ranking.standing.failures[row].times,
        "swings": int(ranking.unsound["limit cycle"][row]),
        "chatters": int(ranking.unsound["chatters"][row]),
        "does not arrive": int(ranking.away[row]),
    }
    if ranking.peak[row] > 0.0:
        counts["pulls harder than a tendon bears"] = ranking.count
    if not any(counts.values()):
        counts["changes with the integration step"] = int(ranking.unsound["not converged"][row])
    if not any(counts.values()):
        counts["swings or chatters"] = ranking.standing.swings[row].times
    return {verb: (sized(verb, [fault_size(verb, ranking, row)]), count) for verb, count in counts.items() if count}


def fault_size(verb: str, ranking: Ranking, row: int) -> float:
    """Size of a fault of a row: a swing peak to peak [rad], a rate of chatter [1/s] or a tension [N]; 0 for none."""
    sizes = {
        "swings": 2.0 * ranking.swing,
        "chatters": ranking.chatter,
        "pulls harder than a tendon bears": ranking.peak,
    }
    return float(sizes[verb][row]) if verb in sizes else 0.0


def sized(verb: str, sizes: Sequence[float]) -> str:
    """Sizes of a fault in words, the least and the largest: by 0.4 to 2.7 deg peak to peak; empty where it has none."""
    if verb == "swings":
        return f"by {between([two(math.degrees(swing)) for swing in sorted(sizes)])} deg peak to peak"
    shown = between([two(value) for value in sorted(sizes)])
    return {"chatters": f"{shown} times a second", "pulls harder than a tendon bears": f"with {shown} N"}.get(verb, "")


def between(shown: Sequence[str]) -> str:
    """The first and the last of sorted numbers in words; one where they are equal."""
    return shown[0] if shown[0] == shown[-1] else f"{shown[0]} to {shown[-1]}"


def fact(ranking: Ranking, row: int) -> str:
    """The gravest fault of a row with its size and number of cases: swings by 2.7 deg peak to peak in 7 of 8 cases."""
    verb, (size, count) = next(iter(facts(ranking, row).items()))
    return " ".join(filter(None, [verb, size, f"in {count} of {counted_in(ranking, verb)}"]))


# Faults in the cell of a table.
_SHORT = {
    "leaves its range": "fails",
    "does not arrive": "no arrival",
    "pulls harder than a tendon bears": "pulls",
    "changes with the integration step": "not converged",
    "swings or chatters": "swings",
}


def short_fact(ranking: Ranking, row: int) -> str:
    """The gravest fault of a row in the cell of a table: swings 2.7 deg 7/8."""
    verb, (_, count) = next(iter(facts(ranking, row).items()))
    value = fault_size(verb, ranking, row)
    sizes = {"swings": f"{two(math.degrees(value))} deg", "chatters": f"{two(value)}/s"}
    size = sizes.get(verb, f"{two(value)} N" if value else "")
    total = ranking.motions if verb == "does not arrive" else ranking.count
    return " ".join(filter(None, [_SHORT.get(verb, verb), size, f"{count}/{total}"]))


def counted_in(ranking: Ranking, verb: str) -> str:
    """Number and kind of what a fault is counted in."""
    return f"{ranking.motions} motions" if verb == "does not arrive" else ranking.cases
