"""How wide is the range of the error that `recommend` expects of a trial, which facts make it, and does it hold?

`python -m tests.commands.expected_ranges` takes five of the wrists of `recommended_rigs` with one controller, the
scaled preset of ct-dob: no search, so a minute or two a wrist. The range over simulated rigs stands beside the share of
fresh rigs within it, with tendons that stretch as believed and as homing measures. With `--facts` each fact is known
while all others are drawn; `--emulated` has the emulated rig's true errors too. What has ended is kept; a later call
goes on there. Writes docs/expected-range.md.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tests.commands.recommended_rigs import SPRINGS, drawn
from tests.drawn_rigs import COMMITTED, ended, options, tried
from wristctl.commands.inputs_of_loops import why_two_planes
from wristctl.commands.recommend.expected import FACTS as FACTS_OF_RIGS
from wristctl.commands.recommend.expected import IDENTIFIED, SCALED, Candidate, asked_for, known_of, rigs_asked, spread
from wristctl.commands.recommend.own_rig import on_the_rig
from wristctl.commands.recommend.reach import asked_of_rigs, family_of_rigs, reach_deg
from wristctl.commands.recommend.rehearsals import _asked, _quietly, motions_of_trial
from wristctl.config.families import Family
from wristctl.config.study import Study
from wristctl.control.table import controller
from wristctl.trial.rehearsed import rehearse
from wristctl.tuning.scaled_presets import scaled_to

PAGE = Path(__file__).parents[2] / "docs" / "expected-range.md"
WRISTS = (1, 9, 3, 0, 6)
"""Numbers of the wrists: four tendons twice hanging and once upright, three hanging and upright."""
CONTROLLER = "ct-dob"
FRESH = 100
"""Rigs that no range has seen."""
FACTS: Mapping[str, tuple[str, ...]] = {
    "stiffness of springs": ("plant.stiffness",),
    "damping": ("plant.damping",),
    "mass of the hand": ("plant.hand_mass",),
    "push on the hand": ("disturbances.load", "disturbances.toward_deg"),
    "stiffness of tendons": ("plant.actuator.tendon_stiffness",),
    "friction of tendons and sheaths": ("plant.actuator.friction", "plant.actuator.sheath"),
    "lever of tendons": ("plant.tendon_radius",),
    "delay of the camera": ("plant.sensor.delay_frames",),
    "noise of the camera": ("plant.sensor.noise_deg",),
    "how the wrist bends": ("plant_segments", "plant.model"),
}
"""What is drawn of a rig."""
WAYS = ("believed", "measured", "identified")
"""Stretch of the tendons by which trials wind; in the last rigs are drawn as an identification leaves them."""


def study_of(number: int, way: str, seed: int = 0, rigs: int = 200) -> Study:
    """The study of a wrist whose trials wind so, with so many simulated rigs of a seed."""
    study = drawn(number).study
    homing = study.hw_run.homing.model_copy(update={"stretch": way if way == WAYS[0] else WAYS[1]})
    changes = {
        "seed": seed,
        "hw_run": study.hw_run.model_copy(update={"homing": homing}),
        "recommend": study.recommend.model_copy(update={"tests": rigs}),
    }
    return on_the_rig(study.model_copy(update=changes))


def asked_of(number: int) -> tuple[int, float]:
    """Planes that a wrist bends in, and the angle that its trial asks for [deg]: where tendons are as believed."""
    study = study_of(number, WAYS[0])
    return 2 if why_two_planes(study.wrist, asked_of_rigs(study)) else 1, reach_deg(study)


def preset(study: Study) -> Candidate:
    """The controller with its preset, scaled to the wrist."""
    law = scaled_to(study.wrist, controller(CONTROLLER))
    return Candidate(CONTROLLER, SCALED, dict(list(law.presets.values())[-1]))


def tried_out(number: int) -> dict[str, Any]:
    """Ranges [deg] and the share of fresh rigs within them, by the way in which trials wind."""
    planes, reach = asked_of(number)
    found: dict[str, Any] = {"reach_deg": reach}
    for way in WAYS:
        study = study_of(number, way)
        best = preset(study)
        motions, horizon = motions_of_trial(study, reach, planes)
        asked = asked_for(family_of_rigs(study, reach), motions, horizon)
        if way == WAYS[2]:
            asked = known_of(asked, [fact for fact in FACTS_OF_RIGS if fact.how == IDENTIFIED])
        rigs = rigs_asked(study, best, asked).following
        fresh = rigs_asked(study_of(number, way, 1, FRESH), best, asked).following
        low, _, high = ends = spread(rigs)
        within = float(np.mean((fresh >= low) & (fresh <= high)))
        found[way] = {"range": np.degrees(ends), "rigs": len(rigs), "fresh": len(fresh), "within": within}
    return found


def left_of(number: int) -> dict[str, Any]:
    """Of each fact the share of the variance of ln RMSE that goes once it is as believed, and the range left [deg]."""
    planes, reach = asked_of(number)
    study = study_of(number, WAYS[1])
    best, (motions, horizon) = preset(study), motions_of_trial(study, reach, planes)
    asked = asked_for(family_of_rigs(study, reach), motions, horizon)
    every, left = float(np.log(rigs_asked(study, best, asked).following).var()), dict[str, Any]()
    for name, keys in FACTS.items():
        if set(keys) & set(asked.draw):
            others = rigs_asked(study, best, _drawing(asked, set(asked.draw) - set(keys))).following
            left[name] = {"gone": 1.0 - float(np.log(others).var()) / every, "range": np.degrees(spread(others))}
    return left


def _drawing(asked: Family, keys: Collection[str]) -> Family:
    """The rigs of which these facts alone are drawn."""
    return asked.model_copy(update={"draw": {key: source for key, source in asked.draw.items() if key in keys}})


def emulated(number: int) -> list[float]:
    """True error [deg] of a wrist's trials on the emulated rig, which winds as homing measures, with either springs."""
    planes, reach = asked_of(number)
    study = study_of(number, WAYS[1])
    best, errors = preset(study), list[float]()
    row = {"controller": best.controller, "gains": dict(best.gains)}
    for springs in SPRINGS:
        with _quietly():
            (run,) = rehearse(study.model_copy(update={"hw_run": _asked(study, [row], reach, planes, springs)}))
        errors.append(math.degrees(run.rmse))
    return errors


def page(
    rows: Mapping[int, dict[str, Any]], truths: Mapping[int, Sequence[float]], facts: Mapping[int, dict[str, Any]]
) -> str:
    """A row for each wrist and way, then what each fact leaves of a range once it is known."""
    names = {number: _named(number) for number in rows}
    lines = [_HEAD.strip(), "", "| wrist, angle | stretch | 95 of 100 rigs [deg] | half by at most | factor | "
             "fresh rigs within | emulated rig, springs x0.7, x1 [deg] |", "|---|---|---|---|---|---|---|"]  # fmt: skip
    for number, found in rows.items():
        for way in WAYS:
            low, median, high = found[way]["range"]
            true = ", ".join(f"{error:.2g}" for error in truths.get(number, ())) if way == WAYS[1] else ""
            lines.append(
                f"| {names[number]}, {found['reach_deg']:.0f} deg | {way} | {low:.2g} to {high:.2g} | {median:.2g} | "
                f"{high / low:.1f} | {100.0 * found[way]['within']:.0f} % of {found[way]['fresh']} | {true or '-'} |"
            )
    if not facts:
        return "\n".join(lines) + "\n"
    heads = [names[number] for number in facts]
    lines += ["", _LEFT.strip(), "", f"| known | {' | '.join(heads)} |", "|---" * (1 + len(heads)) + "|"]
    for name in FACTS:
        cells = [_cell(found.get(name)) for found in facts.values()]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _named(number: int) -> str:
    wrist = drawn(number)
    return f"{wrist.tendons}, {1e3 * wrist.length:.0f} mm, {'hanging' if wrist.hanging else 'upright'}"


def _cell(fact: Mapping[str, Any] | None) -> str:
    if fact is None:
        return "-"
    low, _, high = fact["range"]
    return f"{100.0 * fact['gone']:.0f} %, {low:.2g} to {high:.2g}"


_HEAD = """
# How wide the range of the expected error is, and why

`recommend` says in which range 95 of 100 simulated rigs err in the trial. The table has that range for wrists drawn as
[these](hardware/recommended-rigs.md). All have the scaled preset of ct-dob: 200 rigs, and the share of 100 others
within that range: of 200 rigs a range holds 95 in 100 more or less 1.5, and the fresh ones are the same in all rows.
`believed`: trials wind by the stretch of tendons as they are believed, and date pictures by a delay that may be a frame
off. `measured`: as `recommend` does now, the steps per radian of homing tell the stretch, and the check of a rig the
age of pictures. `identified`: the same once `identify` has told springs, damping, tendons, their
friction and the delay of the camera, as `recommend --from-identified` has it. Rigs whose motors stand at their limit
are not counted. The last column has true errors of the emulated rig, where it was tried.
`python -m tests.commands.expected_ranges --emulated` goes on there.
"""
_LEFT = """
What each fact makes of the second range: the share of the variance of ln RMSE that goes once the fact is as believed,
and the range that is left [deg]. Shares below 10 % are noise of 200 rigs; negative ones, a fact that fills the range.
"""


def main() -> int:
    """Try wrists and write the page."""
    parser = options(__doc__, len(WRISTS), "expected-ranges", COMMITTED)
    parser.add_argument("--emulated", action="store_true", help="the emulated rig, too")
    parser.add_argument("--facts", action="store_true", help="each fact known, too")
    asked = parser.parse_args()
    for number in WRISTS[asked.first : asked.first + asked.count]:
        one = argparse.Namespace(kept=asked.kept, first=number, count=1)
        print(*tried(one, tried_out), flush=True)
        if asked.emulated:
            print(*tried(one, emulated, "emulated"), flush=True)
        if asked.facts:
            print(*tried(one, left_of, "facts"), flush=True)
    every = (ended(asked, *part) for part in ((), ("emulated",), ("facts",)))
    rows, truths, facts = ({number: came[number] for number in WRISTS if number in came} for came in every)
    PAGE.write_text(page(rows, truths, facts))
    return 0


if __name__ == "__main__":
    sys.exit(main())
