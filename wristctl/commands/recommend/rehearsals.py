"""Finalists on the emulated rig, with springs as believed and weaker: who swings or is stopped there?"""

from __future__ import annotations

import logging
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NamedTuple

from wristctl.commands.kept_studies import rig_of
from wristctl.commands.recommend.study_file import sections_of, trial_of
from wristctl.config.families import drawn_value
from wristctl.errors import UserError

if TYPE_CHECKING:
    from wristctl.commands.session import Session
    from wristctl.config.hw_run import HwRunSettings
    from wristctl.config.loop import Reference
    from wristctl.config.study import Study
    from wristctl.trial.rehearsed import Rehearsed

# Springs that weaken to this share of the believed still hold the hand up, with so much in hand: else nobody can home.
_WEAKEST, _IN_HAND = 0.7, 1.2
# Settings of a rehearsal: nobody pushes, and all is found anew in virtual time.
_ALONE = {
    "port": None, "real_time": False, "priority": False, "video": False, "calibration": None, "positions": "find",
    "push": {"force": 0.0}, "without_push": True, "repetitions": 1, "from_identified": None, "network": None,
    "tuned": None,
}  # fmt: skip


class Rehearsal(NamedTuple):
    """A candidate's trials on the emulated rig, by the springs' share of the believed stiffness."""

    runs: Mapping[float, Rehearsed]

    @property
    def rmse(self) -> float:
        """Geometric mean of the true errors [rad]; nan where a run did not end well."""
        return math.exp(sum(math.log(run.rmse) for run in self.runs.values()) / len(self.runs))

    @property
    def swing(self) -> float:
        """Largest true swing at rest, peak to peak [rad]."""
        return max(run.swing for run in self.runs.values())

    @property
    def fault(self) -> str:
        """Why it is not to be used; empty where it is sound."""
        from wristctl.simulation.oscillation import LIMIT_CYCLE

        for scale, run in self.runs.items():
            if run.outcome != "ok":
                return f"is stopped with springs x{scale:g} ({run.outcome.partition(';')[0]})"
            if run.swing > 2.0 * LIMIT_CYCLE:
                return f"swings by {math.degrees(run.swing):.2g} deg peak to peak with springs x{scale:g}"
        return ""


def check_homing(study: Study, planes: int) -> None:
    """UserError, by its name, for a wrist that no rig can home: it buckles under its hand, or sags too far.

    Only where the recommendation is for `hw-run`. Springs may have weakened to 0.7 of what is believed; those of a
    wrist that was identified as far as rigs are drawn.
    """
    from wristctl.trial.resting import judge_weight, sag_of
    from wristctl.trial.rig_belief import PLANES

    if trial_of(study) != "hw-run":
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
    from wristctl.trial.rehearsed import rehearse

    runs: list[dict[float, Rehearsed]] = [{} for _ in rows]
    scales = _scales(study)
    with session.progress("rehearsing on the emulated rig", total=len(scales), unit="rigs") as advance:
        for number, scale in enumerate(scales, start=1):
            asked = _asked(study, rows, reach_deg, planes, scale)
            with _quietly():
                done = rehearse(study.model_copy(update={"hw_run": asked}))
            for of_candidate, run in zip(runs, done, strict=True):
                of_candidate[scale] = run
            advance(number)
    return [Rehearsal(each) for each in runs]


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


def motion_of_rehearsal(study: Study, reach_deg: float, planes: int) -> tuple[Reference, float]:
    """The motion as simulated rigs are asked for it, and how long it is looked at [s]."""
    from wristctl.config.loop import Reference
    from wristctl.trial.motions import has_path

    settings = _asked(study, [], reach_deg, planes, 1.0)
    asked = settings.reference
    if planes == 2 and not has_path(settings):
        toward = {"kind": "diagonal", "toward_deg": 45.0, "duration": asked.duration, "angle_deg": asked.end_deg}
        asked = Reference.model_validate(toward)
    return asked, settings.horizon


def _scales(study: Study) -> list[float]:
    """Shares of the believed stiffness: the emulated rig's own, where springs may be as weak, and 1."""
    shares = dict.fromkeys((study.hw_run.bench.plant.stiffness_scale, 1.0))
    return [share for share in shares if share >= _weakest(study)]


def _weakest(study: Study) -> float:
    """Share of the believed stiffness that springs may have."""
    drawn = study.recommend.draw.get("plant.stiffness")
    low = None if drawn is None else drawn_value(drawn, 0.0)
    return max(_WEAKEST, float(low[1:])) if isinstance(low, str) and low.startswith("x") else _WEAKEST


def _asked(
    study: Study, rows: Sequence[Mapping[str, Any]], reach_deg: float, planes: int, scale: float
) -> HwRunSettings:
    """Trials of all these controllers in one direction on the rig of `recommend.loop`, emulated."""
    from wristctl.config.hw_run import HwRunSettings

    own = study.hw_run
    plant = own.bench.plant.model_copy(update={"stiffness_scale": scale})
    given = own.model_dump(by_alias=True, include=own.model_fields_set)
    tried = {"controllers": tuple(rows)} if rows else {}
    section = sections_of(study, reach_deg, planes)["hw_run"]
    toward = ("ulnar-flexion",) if planes == 2 else ("ulnar",)
    changes = {
        **tried,
        "directions": toward,
        "planes": planes,
        "bench": own.bench.model_copy(update={"plant": plant}),
    }
    return HwRunSettings.model_validate({**given, **section, **rig_of(study.recommend.loop), **_ALONE, **changes})
