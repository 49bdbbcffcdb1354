"""Likely causes of a wrist in two planes that does not do what its motors do, in words, likeliest first.

Both cameras see where the wrist goes. A tendon that is lost leaves a load away from its place, one that pulls too much
a load toward it; motors that are exchanged leave one along the line between their places; a push comes from anywhere.
"""

import math
from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.trial.likely_causes import JUMP, LOOP_SWINGS, MEANT, SWINGS, TURNED
from wristctl.trial.rig_belief import PLANES, TOWARD, pull_directions, unit_toward
from wristctl.wrist.directions import ACTIVE

# A load this far off a tendon's direction [rad] may still be that tendon's doing.
_ASIDE = math.radians(28.0)
# Least share of the load that the lost pull must account for.
_ACCOUNTS = 0.4
# Share of one camera's jump below which the other one saw none.
_ALONE = 0.3
_PUSHED = "this trial's push was harder than safety.load and safety.follow_deg allow"


class SpatialEvidence(NamedTuple):
    """Evidence of the last moments; SI units, planes in the order ulnar, flexion."""

    turned: Array
    """Steps by which each spool was told to reel in, (T,)."""
    torque: Array
    """Torque with which each tendon should bend the straight wrist, by its spool, (T,)."""
    load: Array
    """(2,)"""
    apart: Array
    """Bend less what the spools should have made of it, (2,)."""
    bent: Array
    """Measured change of the bend, (2,)."""
    meant: Array
    """Change of the bend that the spools should have made, (2,)."""
    jump: Array
    """Largest change of each camera's angle from one frame to the next, off what the spools make, (2,)."""
    reversals: int = 0
    """Number of times that a spool has turned back."""
    pushed: bool = False
    """Whether a person pushes in this trial."""
    directions: Array | None = None
    """Direction in which each tendon bends the wrist, from ulnar toward flexion [rad]; None: the board's four."""
    numbers: tuple[int, ...] = ACTIVE
    """Numbers of the tendons."""


def causes_in_space(evidence: SpatialEvidence) -> list[str]:
    """Causes in words."""
    causes = [_PUSHED] * evidence.pushed + [LOOP_SWINGS] * (evidence.reversals >= SWINGS)
    one, other = float(evidence.jump.max()), float(evidence.jump.min())
    alone = one > JUMP and other < _ALONE * one
    if alone:
        plane = PLANES[int(np.argmax(evidence.jump))]
        causes += [
            f"the marker before the {plane} camera has slipped on its disc",
            f"the {plane} camera shows or dates pictures wrongly",
        ]
    meant = float(np.hypot(*evidence.meant))
    if meant > MEANT:
        share = float(evidence.bent @ evidence.meant) / meant**2
        if abs(share) < 0.15:
            causes.append("the motors have no supply, or both cameras show old pictures")
        elif share < 0.0:
            causes.append(
                "the wrist goes the other way than its motors: motors that turn the wrong way or are exchanged"
            )
    causes += _by_direction(evidence)
    if not alone and not evidence.pushed:
        where = _toward(_away_from_motors(evidence))
        causes.append(f"something pushes the wrist toward {where}, or holds it")
    return list(dict.fromkeys(causes))


def _away_from_motors(evidence: SpatialEvidence) -> Array:
    """Direction in which the wrist is off, a unit vector (2,): of the load, or of the bend where there is none."""
    for vector in (evidence.load, evidence.apart):
        if (size := float(np.hypot(*vector))) > 1e-9:
            return vector / size
    return np.zeros(2)


def _by_direction(evidence: SpatialEvidence) -> list[str]:
    off = _away_from_motors(evidence)
    directions = pull_directions() if evidence.directions is None else evidence.directions
    toward = np.stack([np.cos(directions), np.sin(directions)], axis=1) @ off
    much, little = int(np.argmax(toward)), int(np.argmin(toward))
    aside = math.acos(min(1.0, float(toward[much])))
    size = float(np.hypot(*evidence.load))
    if aside <= _ASIDE:
        named = {axis: f"axis {axis} (tendon {evidence.numbers[axis]})" for axis in (much, little)}
        lost = [f"the tendon of {named[little]} is off its pulley, cut or slipped, or its motor has stalled"]
        more = [f"the tendon of {named[much]} is caught, or its motor turns the wrong way"]
        carries = float(evidence.torque[little]) >= _ACCOUNTS * size
        return lost + more if carries or evidence.turned[much] >= -TURNED else more + lost
    plus = [number for number, along in zip(evidence.numbers, toward, strict=True) if along > 0.3]
    minus = [number for number, along in zip(evidence.numbers, toward, strict=True) if along < -0.3]
    sides = [" and ".join(map(str, numbers)) for numbers in (plus, minus)]
    return [
        f"motors of tendons {sides[0]} exchanged with those of {sides[1]}",
        f"tendons {sides[1]} have slipped or come off, or their motors have no power",
    ]


def _toward(unit: Array) -> str:
    """The anatomical direction nearest to a unit vector, in words."""
    name = max(TOWARD, key=lambda name: float(unit_toward(TOWARD[name]) @ unit))
    return name.replace("-", " and ")
