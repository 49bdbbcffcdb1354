"""The answer of trials on a rig: error by direction in degrees, settling, recovery, and how far simulation agrees."""

from __future__ import annotations

import math
from collections.abc import Container, Hashable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from wristctl.commands.answer import Answer, rest
from wristctl.commands.hw_run.trial_means import completed, means, quantities, with_simulation
from wristctl.commands.printed_table import Table, degrees, two
from wristctl.commands.quantities import table_of

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    from numpy.typing import NDArray

    from wristctl.arrays import Array
    from wristctl.simulation.repetitions import Simulation

    Mask = NDArray[np.bool_]

# Factor between measured and simulated error beyond which that is said, where a camera can tell their difference [rad].
APART, _TOLD_APART = 1.5, math.radians(0.02)
# Rows of a table by motion; with more there is a row for each controller and push.
ROWS = 16


def answer_of(
    trials: pd.DataFrame, twins: Mapping[int, Simulation], metrics: Mapping[str, float], marks: Sequence[str], run: str,
    tension_limit: float = math.inf, expected_peak: float = math.inf,
) -> Answer:  # fmt: skip
    """What the trials came to beside their simulation, by the trial's number; `run` is the path of their run.

    A tension beyond `tension_limit` [N] would have stopped them; `expected_peak` [N] is what they need in simulation.
    """
    from wristctl.simulation.trajectory import rests

    done = completed(trials)
    compared, labels = with_simulation(done, twins), list(dict.fromkeys(done["label"]))
    more = rest("All tables, every trial", run)
    larger, smaller = _apart(compared, labels)
    kinder = [*larger, *swings_apart(done, twins, ("simulation",))]
    kinder[-1:] = [f"{last} Do not rely on that simulation here." for last in kinder[-1:]]
    apart = [*kinder, *smaller, *swings_apart(done, twins, ("rig",))]
    notes = [*_at_rest(done, twins, tension_limit, expected_peak), *apart, *unsound(trials, marks, metrics)]
    if not labels:
        return Answer(f"None of {len(trials)} trials was completed.", None, notes, more)
    moving = {number for number, twin in twins.items() if not rests(twin.trajectory)}
    sentences = [_sentence(compared[compared["label"] == label], label, moving) for label in labels[:2]]
    stopped = len(trials) - len(done)
    sentences.append(f"{stopped} of {len(trials)} trials left out." if stopped else "No trial ended early.")
    return Answer(" ".join(sentences), _table(compared), notes, more)


def _sentence(trials: pd.DataFrame, label: str, moving: set[int]) -> str:
    """Errors, settling and recovery of the trials of one controller; numbers of those that never rest are `moving`."""
    two_planes = bool(_planes(trials))
    free, pushed = trials[trials["push"] == 0.0], trials[trials["push"] != 0.0]
    parts = []
    if len(free):
        told = means(free)
        error, said = _error(told)
        each = free.groupby("direction", sort=False)["rmse"].mean()
        if len(each) > 1:
            said.append(f"{degrees(float(each.min()))} to {degrees(float(each.max()))} deg by direction")
        parts.append(error + f" ({'; '.join(said)})" * bool(said))
        if moving.isdisjoint(free["trial"]):
            parts.append(_within("settles", told["settling"]))
    if len(pushed):
        told = means(pushed)
        force = ", ".join(f"{newtons:g}" for newtons in sorted(set(pushed["force"])))
        recovery, known = _recovery(pushed)
        error, said = _error(told)
        never = moving.isdisjoint(pushed["trial"]) and (known or not two_planes)  # else it cannot be known
        if not math.isfinite(recovery) and not never:
            parts.append(f"with a push of {force} N {error}" + f" ({'; '.join(said)})" * bool(said))
        else:
            recovers = "is back at once" if recovery == 0.0 else _within("recovers", recovery)
            parts.append(f"{recovers} after a push of {force} N ({'; '.join([f'{error} with it', *said])})")
    return f"{label}{' in two planes' * two_planes}: {', '.join(parts)}."


def _error(told: Mapping[str, float]) -> tuple[str, list[str]]:
    """The error in degrees; and what it is by plane where there are two, and truly where that is known."""

    def truly(name: str) -> list[str]:
        true = told.get(f"true_{name}", math.nan)
        return [f"truly {_in_deg(true)} deg"] * math.isfinite(true)

    each = [(f"{_in_deg(told[f'rmse_{plane}'])} deg toward {plane}", f"rmse_{plane}") for plane in _planes(told)]
    by_plane = [", ".join([words, *truly(name)]) for words, name in each]
    return f"error {_in_deg(told['rmse'])} deg RMSE", [*by_plane, *truly("rmse"), *_ellipse(told)]


def _ellipse(told: Mapping[str, float]) -> list[str]:
    """The ellipse of an error in two planes: standard deviations along its axes, and where the longer one points."""
    if not math.isfinite(told.get("error_major", math.nan)):
        return []
    axes, truly = (
        " by ".join(_in_deg(told.get(f"{of}error_{axis}", math.nan)) for axis in ("major", "minor")) + " deg"
        for of in ("", "true_")
    )
    known = f" (truly {truly})" * math.isfinite(told.get("true_error_major", math.nan))
    toward = f"{math.degrees(told['error_toward']):.0f} deg from ulnar toward flexion"
    return [f"an ellipse of {axes}, longest {toward}{known}"]


def _planes(names: Container[str]) -> list[str]:
    """Planes of which these names have an error of their own: both, or in one plane none."""
    from wristctl.simulation.trajectory import PLANES

    return [plane for plane in PLANES if f"rmse_{plane}" in names]


def _recovery(pushed: pd.DataFrame) -> tuple[float, bool]:
    """Mean recovery [s], by the true bend where that is known, and whether it is."""
    known = "true_recovery" in pushed and bool(pushed[["true_rmse", "true_recovery"]].notna().any(axis=None))
    return means(pushed)["true_recovery" if known else "recovery"], known


def _within(verb: str, seconds: float) -> str:
    return f"{verb} within {two(seconds)} s" if math.isfinite(seconds) else f"never {verb} in some trial"


def _in_deg(angle: float) -> str:
    return degrees(angle) if math.isfinite(angle) else "-"


# Means in the table of the answer, the last those that a narrow line may go without.
_TOLD = (
    "rmse_ulnar", "rmse_flexion", "rmse", "true_rmse", "simulated_rmse", "settling", "recovery", "steady_state",
)  # fmt: skip


def _table(trials: pd.DataFrame) -> Table:
    """A row for each controller, motion and push; for very many a row for each controller and push.

    Columns without a number are left out.
    """
    by = ["label", "direction", "force"]
    if trials.groupby(by).ngroups > ROWS:
        by.remove("direction")
    first = {name: list(dict.fromkeys(trials[name])) for name in ("label", "direction")}
    groups: list[dict[str, Any]] = [
        dict(zip(by, key, strict=True)) | means(group) | {"recovery": _recovery(group)[0]}
        for key, group in trials.groupby(by, sort=False)
    ]
    groups.sort(key=lambda group: [first[name].index(group[name]) if name in first else group[name] for name in by])
    named = [name for name in by if name != "label" or trials["label"].nunique() > 1]
    known = [name for name in _TOLD if any(math.isfinite(group.get(name, math.nan)) for group in groups)]
    return table_of("", quantities([*named, *known]), groups)


def _at_rest(
    done: pd.DataFrame, twins: Mapping[int, Simulation], tension_limit: float, expected_peak: float
) -> list[str]:
    """The largest swing at rest, where the wrist rests at all, and the largest pull, of trials that ended well."""
    if not len(done):
        return []
    swings, told = swings_of(done, twins), []
    if swings.seen.any():
        told.append(f"the wrist moves by at most {swings.largest()}")
    beside = [f"expected peak {two(expected_peak)} N"] * math.isfinite(expected_peak)
    beside += [f"limit: more than {tension_limit:.3g} N would stop the motors"] * math.isfinite(tension_limit)
    limits = f" ({'; '.join(beside)})" * bool(beside)
    told.append(f"tendons are asked for at most {two(float(done['peak_tension'].max()))} N{limits}")
    facts = "; ".join(told)
    return [f"{facts[0].upper()}{facts[1:]}."]


def _apart(trials: pd.DataFrame, labels: Sequence[str]) -> tuple[list[str], list[str]]:
    """Where measured, or where it is known true, errors are much larger than simulated, and where smaller.

    A paragraph each, or none. What a camera cannot tell, or the trials' own scatter explains, is no difference.
    """
    larger, smaller, names = list[str](), list[str](), [f"rmse_{plane}" for plane in _planes(trials)] or ["rmse"]
    worse = " on the worse axis" * (len(names) > 1)
    for label in labels:
        for pushed in (False, True):
            among = trials[(trials["label"] == label) & ((trials["push"] != 0.0) == pushed)]
            told = means(among)
            known = math.isfinite(told["true_rmse"])
            measured, simulated = (max(told[f"{of}{name}"] for name in names) for of in ("true_" * known, "simulated_"))
            ratio = measured / simulated if simulated > 0.0 else math.nan
            if not math.isfinite(ratio) or 1.0 / APART <= ratio <= APART or abs(measured - simulated) <= _TOLD_APART:
                continue
            each = [among[[f"{of}{name}" for name in names]].max(axis=1) for of in ("true_" * known, "simulated_")]
            if abs(measured - simulated) > _scatter((each[0] - each[1]).to_numpy(float)):
                times = f"{two(max(ratio, 1.0 / ratio))} times {'larger' if ratio > 1.0 else 'smaller'}"
                where = f"{f'{label} ' * (len(labels) > 1)}{'with' if pushed else 'without'} a push"
                size = f"{'truly ' * known}{_in_deg(measured)} deg{worse}"
                facts = larger if ratio > 1.0 else smaller
                facts.append(f"{where} {size}, {times} than {_in_deg(simulated)} deg simulated")
    return (
        [f"Measured and simulated errors do not agree: {'; '.join(larger)}."] * bool(larger),
        [f"The rig does better than its simulation, which is the harsher: {'; '.join(smaller)}."] * bool(smaller),
    )


def _scatter(differences: Array) -> float:
    """What the mean of differences (N,) may be off 0 by their scatter, by 95 %; 0 of fewer than three."""
    if len(differences) < 3:
        return 0.0
    from scipy.special import stdtrit

    error = float(differences.std(ddof=1)) / math.sqrt(len(differences))
    return float(stdtrit(len(differences) - 1, 0.975)) * error


class Swings(NamedTuple):
    """Peak to peak at rest [rad] of trials that ended well, (N,) each; 0 where the reference does not rest for 2 s."""

    seen: Array
    """By the estimated angle."""
    true: Array
    """By the true angle of an emulated wrist; nan where it is not known."""
    simulated: Array
    """Of the same trials in simulation."""

    @property
    def known(self) -> Array:
        """By the true angle where that is known, else by the estimated one."""
        import numpy as np

        return np.where(np.isnan(self.true), self.seen, self.true)

    def largest(self, among: Mask | slice = slice(None)) -> str:
        """The largest, among these trials, as seen and, where that is known, as it truly is."""
        import numpy as np

        true = self.true[among]
        known = true[np.isfinite(true)]
        truly = f" (truly {degrees(float(known.max()))} deg)" if len(known) else ""
        return f"{degrees(float(self.seen[among].max()))} deg peak to peak at rest{truly}"


def swings_of(done: pd.DataFrame, twins: Mapping[int, Simulation]) -> Swings:
    """How trials that ended well swing at rest, and their simulation."""
    import numpy as np

    from wristctl.simulation.oscillation import at_rest, oscillation

    courses = [twins[number].trajectory for number in done["trial"]]
    still = np.array([at_rest(course) for course in courses], bool)
    seen, true = (np.where(still, done[name].to_numpy(float), 0.0) for name in ("swing", "true_swing"))
    simulated = [2.0 * oscillation(course) if rests else 0.0 for course, rests in zip(courses, still, strict=True)]
    return Swings(np.nan_to_num(seen), true, np.array(simulated))


def marks_of(trials: pd.DataFrame, twins: Mapping[int, Simulation], tension_range: float, places: int) -> list[str]:
    """In how many of the trials that ended well the wrist does not arrive, swings at rest, or tensions chatter.

    They chatter where tensions at so many places cross their range [N] faster than any wrist follows.
    """
    import numpy as np

    from wristctl.simulation.arrival import SHORT
    from wristctl.simulation.oscillation import LIMIT_CYCLE, chatter
    from wristctl.simulation.trajectory import rests, size_of

    done = completed(trials)
    chatters = chatter(done["chattering"].to_numpy(float), tension_range, places) > 0.0
    courses = [twins[number].trajectory for number in done["trial"]]
    goals = np.array([size_of(course.bend_ref).max() if rests(course) else np.inf for course in courses])
    short = done["steady_state"].to_numpy(float) > SHORT * goals
    swings = swings_of(done, twins)
    swinging = np.fmax(swings.known, swings.seen) > 2.0 * LIMIT_CYCLE
    size = swings.largest(swinging) if swinging.any() else ""
    found = {"does not arrive": short, f"swings by up to {size}": swinging, "chatters": chatters}
    return [f"{mark}: {int(where.sum())} of {len(done)} trials" for mark, where in found.items() if where.any()]


def swings_apart(
    done: pd.DataFrame, twins: Mapping[int, Simulation], kinder: Sequence[str] = ("simulation", "rig")
) -> list[str]:
    """Where the rig swings at rest and its simulation does not, or the other way round: which is kinder, by how much.

    A sentence for each that is named, of no trial none.
    """
    import numpy as np

    from wristctl.simulation.oscillation import LIMIT_CYCLE

    swings, notes = swings_of(done, twins), []
    both = {"rig": swings.known, "simulation": swings.simulated}
    for resting in kinder:
        swinging = "simulation" if resting == "rig" else "rig"
        one, other = both[swinging], both[resting]
        where = (one > 2.0 * LIMIT_CYCLE) & ~(other > 2.0 * LIMIT_CYCLE)
        if where.any():
            worst = int(np.argmax(np.where(where, one - other, -np.inf)))
            notes.append(
                f"In {int(where.sum())} of {len(done)} trials the {swinging} swings at rest, by up to "
                f"{degrees(float(one[worst]))} deg peak to peak, where the {resting} has "
                f"{degrees(float(other[worst]))} deg: the {resting} is kinder than the {swinging}, by "
                f"{degrees(float(one[worst] - other[worst]))} deg."
            )
    return notes


def unsound(trials: pd.DataFrame, marks: Sequence[str], metrics: Mapping[str, float]) -> list[str]:
    """Trials that do not count or were odd, what the wrist does wrong, and ticks that were skipped."""
    notes = [f"Trial {row['trial']} does not count: {row['outcome']}." for row in _records(trials, "outcome", "ok")[:3]]
    if odd := _records(trials, "odd", ""):
        told = ". ".join(f"Trial {row['trial']}: {row['odd']}" for row in odd[:3])
        were = "was" if len(odd) == 1 else "were"
        notes.append(f"{len(odd)} of {len(trials)} trials went through, but {were} odd. {told}.")
    notes += [f"Of the completed trials: {'; '.join(marks)}."] if marks else []
    if metrics.get("overruns", 0.0) > 0.0:
        skipped, ticks = int(metrics["overruns"]), int(metrics["ticks"])
        notes.append(f"The controller was too slow for its period: {skipped} of {ticks} control ticks were skipped.")
    return notes


def _records(trials: pd.DataFrame, column: str, sound: str) -> list[dict[Hashable, Any]]:
    """Trials whose `column` says something else than is sound."""
    if column not in trials:
        return []
    return [row for row in trials.to_dict("records") if row[column] not in (sound, None) and row[column] == row[column]]
