"""Finalists on the emulated rig, with springs as believed and weaker: who swings or is stopped there?"""

from __future__ import annotations

import logging
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

from wristctl.commands.kept_studies import rig_of
from wristctl.commands.recommend.study_file import sections_of, trial_of
from wristctl.commands.session import Session
from wristctl.config.families import drawn_value
from wristctl.config.hw_run import HwRunSettings, RigDirection
from wristctl.config.loop import Reference
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.simulation.oscillation import LIMIT_CYCLE
from wristctl.trial.motions import has_path
from wristctl.trial.rehearsed import Rehearsed, rehearse
from wristctl.trial.resting import judge_weight, sag_of
from wristctl.trial.rig_belief import PLANES, TOWARD

# Springs that weaken to this share of the believed still hold the hand up, with so much in hand: else nobody can home.
_WEAKEST, _IN_HAND = 0.7, 1.2
# Directions of a rehearsal by the number of planes.
_BOTH_SIDES: dict[int, tuple[RigDirection, ...]] = {1: ("ulnar", "radial"), 2: ("ulnar-flexion", "radial-extension")}
# Settings of a rehearsal: nobody pushes, and all is found anew in virtual time.
_ALONE = {
    "port": None, "real_time": False, "priority": False, "video": False, "calibration": None, "positions": "find",
    "push": {"force": 0.0}, "without_push": True, "repetitions": 1, "from_identified": None, "network": None,
    "tuned": None,
}  # fmt: skip


class Rehearsal(NamedTuple):
    """A candidate's trials on the emulated rig, by the springs' share of the believed stiffness."""

    runs: Mapping[float, Rehearsed]
    """Toward both sides, or on the study's own path in two planes."""
    around: Mapping[float, Rehearsed] = {}
    """In two planes with the hand circling, too."""

    def excess(self, others: Sequence[Rehearsal]) -> float:
        """Largest ratio of its true error to the least of the others on the same springs and motion."""
        ratios = []
        for number, own in enumerate((self.runs, self.around)):
            for scale, run in own.items():
                least = min((other.runs, other.around)[number][scale].rmse for other in others)
                ratios.append(run.rmse / least)
        return max(ratios)

    @property
    def swing(self) -> float:
        """Largest true swing at rest, peak to peak [rad]."""
        return max(run.swing for run in self.runs.values())

    @property
    def fault(self) -> str:
        """Why it is not to be used; empty where it is sound."""
        for motion, own in (("", self.runs), (" on circumduction", self.around)):
            for scale, run in own.items():
                if run.outcome != "ok":
                    return f"is stopped{motion} with springs x{scale:g} ({run.outcome.partition(';')[0]})"
                if not motion and run.swing > 2.0 * LIMIT_CYCLE:
                    return f"swings by {math.degrees(run.swing):.2g} deg peak to peak with springs x{scale:g}"
        return ""


def check_homing(study: Study, planes: int) -> None:
    """UserError, by its name, for a wrist that no rig can home: it buckles under its hand, or sags too far.

    Only where the recommendation is for `hw-run`. Springs may have weakened to 0.7 of what is believed; those of a
    wrist that was identified as far as rigs are drawn.
    """
    if trial_of(study) != "hw-run" or study.hw_run.rig is not None:
        return
    names = PLANES if planes == 2 else ("ulnar",)
    judge_weight(study.hw_run, study.wrist, names)
    weakest = _weakest(study)
    weakened = study.wrist.model_copy(update={"stiffness": study.wrist.stiffness * weakest / _IN_HAND})
    if any(math.isinf(sag_of(weakened, plane)) for plane in names):
        problem = (
            f"without taut tendons the wrist buckles under its weight where its springs weaken to {weakest:g} of "
            "their stiffness: no rig can be homed with it"
        )
        raise UserError(problem, "wrist", "a lighter hand, stiffer springs, or a hanging wrist (wrist.gravity)", 3)


def rehearsed(
    session: Session, study: Study, rows: Sequence[Mapping[str, Any]], reach_deg: float, planes: int
) -> list[Rehearsal]:
    """Trials of these controllers with their gains, in their order.

    Raises SafetyStop where the emulated rig cannot be homed.
    """
    runs: list[dict[float, Rehearsed]] = [{} for _ in rows]
    around: list[dict[float, Rehearsed]] = [{} for _ in rows]
    scales = _scales(study)
    with session.progress("rehearsing on the emulated rig", total=len(scales), unit="rigs") as advance:
        for number, scale in enumerate(scales, start=1):
            asked = _asked(study, rows, reach_deg, planes, scale)
            _rehearse(study, asked, scale, runs)
            if planes == 2 and not has_path(asked):
                circling = asked.model_copy(update={"reference": _circling(asked.reference)})
                _rehearse(study, circling, scale, around)
            advance(number)
    return [Rehearsal(*each) for each in zip(runs, around, strict=True)]


def _rehearse(study: Study, asked: HwRunSettings, scale: float, runs: Sequence[dict[float, Rehearsed]]) -> None:
    """Try all candidates with springs of this share, and note how each does."""
    with _quietly():
        done = rehearse(study.model_copy(update={"hw_run": asked}))
    for of_candidate, run in zip(runs, done, strict=True):
        of_candidate[scale] = run


def _circling(reference: Reference) -> Reference:
    """The hand circles with a bend as large as the reference's."""
    return Reference.model_validate({"kind": "circumduction", "angle_deg": abs(reference.end_deg)})


@contextmanager
def _quietly() -> Iterator[None]:
    """What homing tells of every tendon is left out."""
    told = logging.getLogger("wristctl.trial")
    before = told.level
    told.setLevel(logging.WARNING)
    try:
        yield
    finally:
        told.setLevel(before)


def motions_of_trial(study: Study, reach_deg: float, planes: int) -> tuple[list[Reference], float]:
    """The motions of the rehearsed trials as simulated rigs are asked for them, and how long each is looked at [s]."""
    settings = _asked(study, [], reach_deg, planes, 1.0)
    asked = settings.reference
    if planes == 1:
        sides = dict.fromkeys(direction in ("ulnar", "flexion") for direction in settings.directions)
        return [asked if ahead else asked.mirrored() for ahead in sides], settings.horizon
    if has_path(settings):
        return [asked], settings.horizon
    toward = dict.fromkeys(TOWARD[direction] for direction in settings.directions)
    line = {"kind": "diagonal", "duration": asked.duration, "angle_deg": asked.end_deg}
    return [Reference.model_validate({**line, "toward_deg": angle}) for angle in toward], settings.horizon


def _scales(study: Study) -> list[float]:
    """Shares of the believed stiffness: the emulated rig's own, where springs may be as weak, and 1."""
    shares = dict.fromkeys((study.hw_run.bench.plant.stiffness_scale, 1.0))
    return [share for share in shares if share >= _weakest(study)]


def _weakest(study: Study) -> float:
    """Share of the believed stiffness that springs may have."""
    drawn = study.recommend.drawn.get("plant.stiffness")
    low = None if drawn is None else drawn_value(drawn, 0.0)
    return max(_WEAKEST, float(low[1:])) if isinstance(low, str) and low.startswith("x") else _WEAKEST


def _asked(
    study: Study, rows: Sequence[Mapping[str, Any]], reach_deg: float, planes: int, scale: float
) -> HwRunSettings:
    """Trials of all these controllers on the rig of `recommend.loop`, emulated.

    In the directions that the study has, else to both sides.
    """
    own = study.hw_run
    given = own.model_dump(by_alias=True, include=own.model_fields_set)
    tried = {"controllers": tuple(rows)} if rows else {}
    section = sections_of(study, reach_deg, planes)["hw_run"]
    leaves = {**section.get("bench", {}), "plant": {"stiffness_scale": scale}}
    bench = {part: getattr(own.bench, part).model_copy(update=values) for part, values in leaves.items()}
    changes = {
        **tried,
        "directions": own.directions if "directions" in own.model_fields_set else _BOTH_SIDES[planes],
        "planes": planes,
        "bench": own.bench.model_copy(update=bench),
    }
    return HwRunSettings.model_validate({**given, **section, **rig_of(study.recommend.loop), **_ALONE, **changes})
