"""The answer of trials on a rig: error by direction in degrees, settling, recovery, and how far simulation agrees."""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from wristctl.commands.answer import Answer
from wristctl.commands.printed_table import Table, degrees, two

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    from numpy.typing import NDArray

    from wristctl.arrays import Array
    from wristctl.simulation.repetitions import Simulation

    Mask = NDArray[np.bool_]

# Factor between measured and simulated error beyond which that is said.
APART = 1.5
# Rows of a table by direction; with more there is a row for each controller.
ROWS = 16


class Means(NamedTuple):
    """Means over trials that ended well; nan where there is none, or where one of them never settles."""

    trials: int
    rmse: tuple[float, ...]
    """In each plane [rad]."""
    steady_state: float
    """[rad]"""
    settling: float
    """[s]"""
    recovery: float
    """By the true bend, where an emulated rig knows it [s]."""
    simulated: float
    """RMSE of the same trials in simulation, of the true bend in the worse plane [rad]."""
    true: float
    """RMSE of the true bend in the worse plane, where an emulated rig knows it [rad]."""

    @property
    def worse(self) -> float:
        """RMSE in the worse plane [rad]."""
        return max(self.rmse)

    @property
    def compared(self) -> float:
        """What the simulation is held against: the true error where it is known, else the measured one [rad]."""
        return self.true if math.isfinite(self.true) else self.worse

    @property
    def apart(self) -> bool:
        """Whether that and the simulated error differ by more than APART."""
        ratio = self.compared / self.simulated if self.simulated > 0.0 else math.nan
        return math.isfinite(ratio) and not 1.0 / APART <= ratio <= APART


def errors_of(trials: pd.DataFrame) -> dict[str, str]:
    """Names of the RMSE in each plane, with where it is toward; of one plane that is not said."""
    by_plane = {f"rmse_{plane}": f" toward {plane}" for plane in ("ulnar", "flexion")}
    return by_plane if set(by_plane) <= set(trials) else {"rmse": ""}


def means_of(trials: pd.DataFrame, twins: Mapping[int, Simulation]) -> Means:
    """Means of some trials."""
    import numpy as np

    def mean(name: str) -> float:
        return float(trials[name].mean(skipna=False)) if len(trials) and name in trials else math.nan

    names = list(errors_of(trials))
    simulated = [max(twins[number].metrics[name] for name in names) for number in trials["trial"]]
    model = float(np.mean(simulated)) if simulated else math.nan
    true, truly = math.nan, [f"true_{name}" for name in names]
    if len(trials) and set(truly) <= set(trials):
        true = float(trials[truly].max(axis=1, skipna=False).mean(skipna=False))
    known = "true_recovery" in trials and trials["true_recovery"].notna().any()
    recovery = mean("true_recovery" if known else "recovery")
    rmse = tuple(map(mean, names))
    return Means(len(trials), rmse, mean("steady_state"), mean("settling"), recovery, model, true)


def answer_of(
    trials: pd.DataFrame, twins: Mapping[int, Simulation], metrics: Mapping[str, float], marks: Sequence[str], run: str
) -> Answer:
    """What the trials came to.

    `trials` are all that began; `twins` has the simulation of those that ended well, by their numbers; `run` is the
    path of their run.
    """
    done = completed(trials)
    labels = list(dict.fromkeys(done["label"]))
    more = f"All tables: --all. Every trial: {run}/report.html" if run else "All tables: `.tables`."
    notes = [*_apart(done, labels, twins), *swings_apart(done, twins), *unsound(trials, marks, metrics)]
    if not labels:
        return Answer(f"None of {len(trials)} trials was completed.", None, notes, more)
    sentences = [_sentence(done[done["label"] == label], label, twins) for label in labels[:2]]
    stopped = len(trials) - len(done)
    sentences.append(f"{stopped} of {len(trials)} trials left out." if stopped else "No trial ended early.")
    return Answer(" ".join(sentences), _table(done, labels, twins), notes, more)


def _sentence(trials: pd.DataFrame, label: str, twins: Mapping[int, Simulation]) -> str:
    from wristctl.simulation.trajectory import rests

    free, pushed = trials[trials["push"] == 0.0], trials[trials["push"] != 0.0]
    toward = list(errors_of(trials).values())
    parts = []

    def error(means: Means) -> str:
        angles = [
            f"{in_deg(angle)} deg{' RMSE' * (not k)}{way}"
            for k, (angle, way) in enumerate(zip(means.rmse, toward, strict=True))
        ]
        return f"error {', '.join(angles)}"

    def truly(means: Means) -> list[str]:
        worse = " on the worse axis" * (len(toward) > 1)
        return [f"truly {in_deg(means.true)} deg{worse}"] * math.isfinite(means.true)

    if len(free):
        means = means_of(free, twins)
        each = [means_of(group, twins).worse for _, group in free.groupby("direction", sort=False)]
        said = truly(means)
        said += [f"{degrees(min(each))} to {degrees(max(each))} deg by direction"] * (len(each) > 1)
        parts.append(error(means) + f" ({'; '.join(said)})" * bool(said))
        if all(rests(twins[number].trajectory) for number in free["trial"]):
            parts.append(_within("settles", means.settling))
    if len(pushed):
        means = means_of(pushed, twins)
        force = ", ".join(f"{newtons:g}" for newtons in sorted({abs(force) for force in pushed["push"]}))
        recovers = "is back at once" if means.recovery == 0.0 else _within("recovers", means.recovery)
        with_it = f"{error(means)} with it{''.join(f', {words}' for words in truly(means))}"
        parts.append(f"{recovers} after a push of {force} N ({with_it})")
    return f"{label}{' in two planes' * (len(toward) > 1)}: {', '.join(parts)}."


def _within(verb: str, seconds: float) -> str:
    return f"{verb} within {two(seconds)} s" if math.isfinite(seconds) else f"never {verb} in some trial"


def in_deg(angle: float) -> str:
    """An angle [rad] in degrees; a dash where there is none."""
    return degrees(angle) if math.isfinite(angle) else "-"


def in_s(seconds: float) -> str:
    """A time [s]; a dash where there is none."""
    return two(seconds) if math.isfinite(seconds) else "-"


def completed(trials: pd.DataFrame) -> pd.DataFrame:
    """Trials that ended well, with `label`, and their swings at rest from crest to crest [rad], by log and truly."""
    done = trials[trials["outcome"] == "ok"]
    swings = {f"{true}swing": 2.0 * done[f"{true}oscillation"] for true in ("", "true_")}
    return done.assign(label=done["controller"] + "/" + done["gains"], **swings)


class Swings(NamedTuple):
    """Peak to peak at rest [rad] of trials that ended well, (N,) each; 0 where the reference does not rest for 2 s."""

    seen: Array
    """By the estimated angle."""
    true: Array
    """By the true angle of an emulated wrist; nan where it is not known."""
    simulated: Array
    """Of the same trials in simulation."""

    @property
    def rig(self) -> Mask:
        """In which trials the rig swings, (N,): by its true angle where that is known."""
        import numpy as np

        from wristctl.simulation.oscillation import LIMIT_CYCLE

        swings: Mask = np.where(np.isnan(self.true), self.seen, self.true) > 2.0 * LIMIT_CYCLE
        return swings

    @property
    def simulation(self) -> Mask:
        """In which trials their simulation swings, (N,)."""
        from wristctl.simulation.oscillation import LIMIT_CYCLE

        swings: Mask = self.simulated > 2.0 * LIMIT_CYCLE
        return swings


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
    swinging = swings.rig | (swings.seen > 2.0 * LIMIT_CYCLE)
    size = ""
    if swinging.any():
        size = f"{degrees(float(swings.seen[swinging].max()))} deg peak to peak at rest"
        if np.isfinite(swings.true[swinging]).any():
            size += f" (truly {degrees(float(np.nanmax(swings.true[swinging])))} deg)"
    found = {"does not arrive": short, f"swings by up to {size}": swinging, "chatters": chatters}
    return [f"{mark}: {int(where.sum())} of {len(done)} trials" for mark, where in found.items() if where.any()]


def swings_apart(done: pd.DataFrame, twins: Mapping[int, Simulation]) -> list[str]:
    """Where the rig swings at rest and its simulation does not, or the other way round: which is kinder, by how much.

    A sentence for each, of no trial none.
    """
    import numpy as np

    swings, notes = swings_of(done, twins), []
    rig = np.where(np.isnan(swings.true), swings.seen, swings.true)
    for where, one, other, kinder in (
        (swings.rig & ~swings.simulation, rig, swings.simulated, "the simulation is kinder than the rig"),
        (swings.simulation & ~swings.rig, swings.simulated, rig, "the rig is kinder than the simulation"),
    ):
        if not where.any():
            continue
        worst = int(np.argmax(np.where(where, one - other, -np.inf)))
        swinging, resting = ("rig", "simulation") if one is rig else ("simulation", "rig")
        notes.append(
            f"In {int(where.sum())} of {len(done)} trials the {swinging} swings at rest, by up to "
            f"{degrees(float(one[worst]))} deg peak to peak, where the {resting} has {degrees(float(other[worst]))} "
            f"deg: {kinder}, by {degrees(float(one[worst] - other[worst]))} deg. Do not rely on that simulation here."
        )
    return notes


def _table(done: pd.DataFrame, labels: Sequence[str], twins: Mapping[int, Simulation]) -> Table:
    """A row for each motion and controller, with and without a push; for very many a row for each controller."""
    directions = list(dict.fromkeys(done["direction"]))
    by_direction = len(directions) * len(labels) <= ROWS
    toward = list(errors_of(done).values())
    worse = ", worse axis" * (len(toward) > 1)
    heads = (
        "controller", "motion" if worse else "direction", *(f"{way[1:] or 'error'} [deg]" for way in toward),
        f"simulated{worse} [deg]", "final error [deg]", "settling [s]", f"pushed{worse} [deg]", "recovery [s]",
    )  # fmt: skip
    rows = []
    for label in labels:
        of_label = done[done["label"] == label]
        for direction in directions if by_direction else ["all"]:
            group = of_label if direction == "all" else of_label[of_label["direction"] == direction]
            if group.empty:
                continue
            free, pushed = (means_of(group[(group["push"] != 0.0) == push], twins) for push in (False, True))
            rows.append(
                (label, direction, *map(in_deg, (*free.rmse, free.simulated, free.steady_state)),
                 in_s(free.settling), in_deg(pushed.worse), in_s(pushed.recovery))
            )  # fmt: skip
    always = 3 + len(toward)
    told = [column for column in range(len(heads)) if column < always or any(row[column] != "-" for row in rows)]
    shown = [column for column in told if column > 0 or len(labels) > 1]
    return Table("", [heads[column] for column in shown], [tuple(row[column] for column in shown) for row in rows])


def _apart(done: pd.DataFrame, labels: Sequence[str], twins: Mapping[int, Simulation]) -> list[str]:
    """Where measured and simulated errors differ much, in one paragraph."""
    facts = []
    worse = " on the worse axis" * (len(errors_of(done)) > 1)
    for label in labels:
        for pushed in (False, True):
            means = means_of(done[(done["label"] == label) & ((done["push"] != 0.0) == pushed)], twins)
            if means.apart:
                ratio = means.compared / means.simulated
                times = f"{two(max(ratio, 1.0 / ratio))} times {'larger' if ratio > 1.0 else 'smaller'}"
                where = f"{f'{label} ' * (len(labels) > 1)}{'with' if pushed else 'without'} a push"
                true, simulated = "truly " * math.isfinite(means.true), in_deg(means.simulated)
                facts.append(
                    f"{where} {true}{in_deg(means.compared)} deg{worse}, {times} than {simulated} deg simulated"
                )
    if not facts:
        return []
    return [f"Measured and simulated errors do not agree: {'; '.join(facts)}. Do not rely on that simulation here."]


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
