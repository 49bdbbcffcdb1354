"""What is recommended, in words: controller and gains, the error to expect, what not to use, and the limits."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from typing import TYPE_CHECKING, NamedTuple

from wristctl.commands.answer import Answer
from wristctl.commands.kept_studies import FOLDER
from wristctl.commands.printed_table import Table, degrees, joined, two
from wristctl.commands.recommend.expected import ENOUGH, TUNED, Candidate, Expected, share_of, spread
from wristctl.commands.recommend.study_file import own_rig, takers_of
from wristctl.commands.results import StudyResult
from wristctl.errors import UserError

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.commands.recommend.rehearsals import Rehearsal
    from wristctl.comparison.world_ranking import WorldRanking
    from wristctl.trial.rehearsed import Rehearsed
    from wristctl.tuning.search import Search

# File with what is recommended, for `simulate`, `compare` and `hw-run`.
RECOMMENDED = "data/recommended.yaml"
# Factor on the least error up to which a controller is taken that is lost on fewer rigs.
NEAR = 1.25
# Probability below which equals would differ as much, so that a difference counts as shown.
_SHOWN = 0.05
# What nothing here says anything of.
_BEYOND = "Do not use it beyond these limits, or on another wrist or rig, without trying it there."
# Angle of the sines by which it is found how fast a motion may be, where the tendons reach it [deg].
_SINE_DEG = 20.0


class Limit(NamedTuple):
    """How one motion or payload went, on so many simulated rigs."""

    value: float
    """Frequency [Hz] or mass [kg]."""
    rigs: int
    lost: int
    """Rigs on which the wrist fails, swings, chatters, or the numbers did not converge."""
    error: float
    """Median RMSE [rad]."""
    swing: float
    """Largest swing of any rig, at rest or beside the reference's own motion [rad]."""


@dataclass(frozen=True, repr=False, eq=False)
class Recommended(StudyResult):
    """Candidates in order on rigs that no search has seen; how fast the best may move, and what it may carry."""

    kind = "recommend"

    reach_deg: float
    """Angle [deg] to either side that the tendons hold on 19 of 20 simulated rigs."""
    candidates: list[Candidate]
    ranking: WorldRanking
    """`ranking.rows` are the candidates in order, feedforward last."""
    searches: dict[str, Search]
    motions: list[Limit]
    payloads: list[Limit]
    next_command: str
    """Command that tries the recommendation on the rig."""
    rehearsals: Mapping[int, Rehearsal] = field(default_factory=dict)
    """Of the candidates that were rehearsed on the emulated rig, by their numbers."""
    on_the_trial: Expected | None = None
    """Error over the simulated rigs in the trial that is rehearsed."""
    reach_identified: float | None = None
    """Angle [deg] that the tendons would hold, were the wrist identified; None where that is not asked."""
    facts: str = ""
    """What the facts of a robot of one's own say of the simulated rigs, a sentence or two."""
    bending: str = ""
    """Planes that all loops bend in, a sentence; empty where they stay in one."""

    @property
    def on_a_rig(self) -> bool:
        """Whether the next command drives a rig, as `hw-run` does; else none has these motors and tendons."""
        return self.next_command.startswith("wristctl hw-run")

    @property
    def best(self) -> Candidate | None:
        """Recommended controller and gains; None where none with feedback is among the best to rely on."""
        return None if self.best_row is None else self.candidates[self.best_row]

    @property
    def best_row(self) -> int | None:
        """Its number among the candidates and the ranking's rows; None where no feedback is in the first group.

        The first of `near`; where some were rehearsed, the first of these that is sound on the emulated rig and errs
        there at most a quarter more than the least of them with the same springs and motion. Where each errs more than
        that somewhere, the one that errs least more.
        """
        if not any(self.candidates[row].gains for row in chain(*self.ranking.standing.groups[:1])):
            return None
        if not self.rehearsals:
            return self.near[0]
        excess = self.excess
        calm = [row for row in excess if excess[row] <= NEAR]
        return calm[0] if calm else min(excess, key=excess.__getitem__, default=None)

    @property
    def excess(self) -> dict[int, float]:
        """Of those of `near` that are sound in their rehearsal, in order, by how much they err more than the least."""
        tried = {row: self.rehearsals[row] for row in self.near if row in self.rehearsals}
        sound = {row: rehearsal for row, rehearsal in tried.items() if not rehearsal.fault}
        return {row: rehearsal.excess([*sound.values()]) for row, rehearsal in sound.items()}

    @property
    def untried(self) -> list[int]:
        """Of `near`, what has not been rehearsed."""
        return [row for row in self.near if row not in self.rehearsals]

    @property
    def near(self) -> list[int]:
        """Rows with feedback that err at most a quarter more than the least of them, none more than feedforward.

        First what is not shown to be lost on more rigs than the one that is lost on the fewest; of these those of the
        first group, then those with the fewest gains.
        """
        standing, errors = self.ranking.standing, [mean.value for mean in self.ranking.means]
        open_loop = standing.group(len(self.candidates) - 1) or len(standing.groups)
        sound = [row for row in chain(*standing.groups[:open_loop]) if self.candidates[row].gains]
        near = [row for row in sound if errors[row] <= NEAR * min(errors[other] for other in sound)]
        calmest = min(near, key=lambda row: standing.lost[row].times, default=0)
        return sorted(
            near,
            key=lambda row: (
                self.lost_more(row, calmest), standing.group(row), len(self.candidates[row].gains),
                standing.lost[row].times,
            ),
        )  # fmt: skip

    def lost_more(self, row: int, other: int) -> bool:
        """Whether a row is shown to be lost on more rigs than another, by those on which one of both is (sign test)."""
        import numpy as np
        from scipy.stats import binomtest

        if self.ranking.standing.lost[row].times <= self.ranking.standing.lost[other].times:
            return False
        own, its = (each.swings | ~np.isfinite(each.rmse) for each in map(self.ranking.rows.__getitem__, (row, other)))
        more, fewer = int((own & ~its).sum()), int((its & ~own).sum())
        return bool(binomtest(more, more + fewer, alternative="greater").pvalue < _SHOWN)

    @property
    def why_none(self) -> str:
        """Reason for which nothing is recommended."""
        if self.rehearsals:
            return "everything near the best swings or is stopped in its rehearsal on the emulated rig"
        sound = [row for group in self.ranking.standing.groups for row in group if self.candidates[row].gains]
        if sound:
            return "no controller with feedback that can be relied on errs less than feedforward"
        return "every controller with feedback fails, swings or chatters on too many rigs"

    @property
    def fault(self) -> UserError | None:
        """Error where nothing can be recommended; None where something is."""
        if self.best is not None:
            return None
        fix = "a stiffer drive, a faster camera or slower motions (recommend.loop, recommend.references)"
        return UserError(f"nothing to recommend: {self.why_none}", self.place, fix, exit_code=3)

    @property
    def marks(self) -> list[str]:
        """`nothing to recommend` where that is so."""
        return ["nothing to recommend"] * (self.best is None)

    def frame(self) -> pd.DataFrame:
        """A row for each candidate, best first; angles in rad."""
        from wristctl.comparison.world_ranking import ranking_frame

        return ranking_frame(self.ranking)

    @property
    def answer(self) -> Answer:
        """What to run, what error to expect, what not to use, and the limits."""
        more = f"Gains of each row, for {takers_of(self.study)}: {FOLDER}/. Every rig: data/rigs.csv."
        return Answer(_sentence(self), _table(self), _notes(self), more)


def _sentence(result: Recommended) -> str:
    best, ranked, row = result.best, result.ranking, result.best_row
    if best is None or row is None:
        return f"Nothing can be recommended: {result.why_none}."
    low, median, high = spread(ranked.rows[row].rmse)
    values = ", ".join(_gain(best, name) for name in best.gains)
    sentence = (
        f"Use {best.controller} with {values}. Expect an error of {degrees(median)} deg RMSE ({degrees(low)} to "
        f"{degrees(high)} deg on {share_of(ranked.count)} simulated rigs), {two(ranked.gains[row].value)} times lower "
        "than feedforward alone."
    )
    if ranked.count < ENOUGH:
        sentence += f" So few rigs prove little: {ENOUGH} or more with recommend.tests."
    if lost := _lost(ranked, row):
        sentence += f" It {lost} of {ranked.count} rigs."
    first = ranked.standing.groups[0]
    if row in first:
        others = joined([result.candidates[other].label for other in first if other != row])
        why = (
            f"These rigs do not tell its error from that of {others}. Of the controllers with feedback whose error is "
            "at most 25 % above the least, none is shown to be stable on more rigs; of equals it has the fewest gains"
            f"{' of those that do well in their rehearsal' * bool(result.rehearsals)}."
        )
        return f"{sentence} {why}" if others else f"{sentence} These rigs tell its error from that of every other."
    lesser = [other for other in first if other in result.near]
    least = ranked.means[row].value / min(ranked.means[other].value for other in lesser)
    others, be = joined([result.candidates[other].label for other in lesser]), "are" if lesser[1:] else "is"
    rehearsed = all(other in result.rehearsals for other in lesser)
    but = f"{'do' if lesser[1:] else 'does'} worse when rehearsed" if rehearsed else f"{be} unstable on more rigs"
    return f"{sentence} {others} would err up to {two(least)} times less, and {but}."


def _gain(candidate: Candidate, name: str) -> str:
    from wristctl.control.table import controller

    return f"{name} = {candidate.gains[name]:.3g} {controller(candidate.controller).gains[name].unit}".rstrip()


def _table(result: Recommended) -> Table:
    """Candidates from best to worst; those that cannot be relied on come last, with the reason."""
    ranked, rows = result.ranking, []
    for k in ranked.standing.order:
        low, median, high = (degrees(error) if math.isfinite(error) else "-" for error in spread(ranked.rows[k].rmse))
        lost = _lost(ranked, k)
        rows.append((result.candidates[k].label, median, f"{low} to {high}", lost or "stable on all"))
    ends, lost_on = f"on {share_of(ranked.count)} rigs [deg]", f"of {ranked.count} simulated rigs"
    heads = ("controller (gains)", "error [deg]", ends, lost_on)
    return Table("", heads, rows)


def files_table(candidates: Sequence[Candidate], takers: str) -> Table:
    """Gains of every row, in the order of the candidates, with the file of each."""
    rows = [(one.label, ", ".join(_gain(one, name) for name in one.gains) or "-", one.file) for one in candidates]
    title = f"Gains of every row, best first; each file is for {takers}"
    return Table(title, ("controller (gains)", "gains", "file"), rows)


def _lost(ranked: WorldRanking, k: int) -> str:
    """On how many rigs a candidate fails, and on how many it swings and by how much; empty where stable on all."""
    failures, swings = ranked.standing.failures[k].times, ranked.standing.swings[k].times
    swing = ranked.rows[k].measured.largest_swing(ranked.rows[-1].measured)
    size = f"swings by up to {degrees(2.0 * swing)} deg peak to peak" if swing > 0.0 else "chatters"
    return ", ".join([f"fails on {failures}"] * bool(failures) + [f"{size} on {swings}"] * bool(swings))


def _notes(result: Recommended) -> list[str]:
    from wristctl.commands.ranking_answer import decided

    wanted = result.study.recommend.largest_deg
    short = f" (asked: {wanted:g} deg)" if result.reach_deg < wanted else ""
    sides = "any side" if result.bending else "either side"
    notes = [result.bending] * bool(result.bending) + [result.facts] * bool(result.facts)
    most = "on 19 of 20 simulated rigs" if result.ranking.count >= ENOUGH else "on the simulated rigs"
    hold = f"The tendons hold {result.reach_deg:g} deg to {sides} {most}{short}"
    if result.reach_identified is not None and result.reach_identified > result.reach_deg:
        hold += f", {result.reach_identified:g} deg once tendons and springs are known (wristctl identify)"
    hold += "."
    notes += [" ".join(filter(None, (hold, decided([result.ranking]), _not_tuned(result))))]
    rehearsed = _rehearsed(result) if result.rehearsals else ""
    if result.best is None:
        return notes + [rehearsed] * bool(rehearsed)
    motion, sides = ("ellipses", "any side") if result.bending else ("sines", "both sides")
    sine = f"{motion} of {sine_deg(result.reach_deg):g} deg to {sides}"
    holds = f"{_up_to(result.motions, 'Hz', sine)} {_up_to(result.payloads, 'kg', 'an unknown payload in the hand')}"
    notes.append(f"{rehearsed} {holds} {_BEYOND}".strip())
    how = "simulated; on a robot of your own, hw-run --rig my_rig.py:RIG in place of simulate"
    if (own := own_rig(result.study)) is not None:
        how = f"on {own}"
    elif result.on_a_rig:
        cameras = (
            "--set camera_2=2 --optics RUN --optics-2 RUN" if result.bending else "--optics latest:calibrate-camera"
        )
        how = f"emulated (on a real rig also --port /dev/ttyACM0 --camera 0 {cameras})"
    return [*notes, f"Next, {how}:", f"$ {result.next_command}"]


def _not_tuned(result: Recommended) -> str:
    """Of which controllers the search found no gains but the preset's, which are a row of their own."""
    tuned = {one.controller for one in result.candidates if one.origin == TUNED}
    same = [name for name in result.searches if name not in tuned]
    if not same:
        return ""
    settings = result.study.recommend
    return (
        f"The search ({settings.iterations} x {settings.candidates} candidates) found nothing better than the scaled "
        f"preset for {joined(same)}."
    )


def _rehearsed(result: Recommended) -> str:
    """What the emulated rig says of the finalists: the true errors of the recommended one, and who is out and why."""
    words = []
    if result.best_row is not None:
        best = result.rehearsals[result.best_row]
        each = _errors(best.runs)
        circles = f", circling by {_errors(best.around)}" if best.around else ""
        swing = degrees(best.swing)
        words.append(
            f"Rehearsed on the emulated rig it truly errs by {each}{circles}, and swings by {swing} deg peak to peak."
        )
        if result.on_the_trial is not None:
            words.append(result.on_the_trial.said)
    excess, order = result.excess, list(result.excess)
    passed = order[: order.index(result.best_row)] if result.best_row is not None else []
    for label, times in ((result.candidates[row].label, two(excess[row])) for row in passed):
        words.append(f"{label} errs there up to {times} times as much as the least of all, and is not recommended.")
    others = [(result.candidates[row].label, run.fault) for row, run in result.rehearsals.items() if run.fault]
    words += [f"{label} {fault} there, and is not recommended." for label, fault in others]
    return " ".join(words)


def _errors(runs: Mapping[float, Rehearsed]) -> str:
    return joined([f"{degrees(run.rmse)} deg with springs x{scale:g}" for scale, run in runs.items()])


def _up_to(limits: Sequence[Limit], unit: str, subject: str) -> str:
    """Up to which value nothing was lost, and what was at the next."""
    from wristctl.simulation.oscillation import LIMIT_CYCLE

    sound = next((k for k, limit in enumerate(limits) if limit.lost), len(limits))
    begin = f"It holds {subject} up to {limits[sound - 1].value:g} {unit}" if sound else f"It does not hold {subject}"
    if sound:
        begin += f" ({degrees(limits[sound - 1].error)} deg RMSE)"
    if sound == len(limits):
        return f"{begin}, the largest tried."
    beyond = limits[sound]
    how = (
        f"swings by up to {degrees(2.0 * beyond.swing)} deg peak to peak"
        if beyond.swing > LIMIT_CYCLE
        else "chatters or fails"
    )
    return f"{begin}: at {beyond.value:g} {unit} it {how} on {beyond.lost} of {beyond.rigs} rigs."


def sine_deg(reach_deg: float) -> float:
    """Angle [deg] of the sines that are tried, of what the tendons reach."""
    return min(_SINE_DEG, math.floor(0.7 * reach_deg))
