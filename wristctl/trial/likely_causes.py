"""Likely causes of a wrist that does not do what its motors do, in words, likeliest first."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from wristctl.arrays import Array
from wristctl.wrist.directions import ACTIVE

# Steps in the time looked at from which a motor has turned.
TURNED = 40.0
# Bend in that time from which the wrist was meant to move.
MEANT = math.radians(2.0)
# Turnings back, in the time looked at for them, from which a loop swings: a motion there and back has one.
SWINGS = 3
LOOP_SWINGS = "the loop swings: friction in the sheaths, a camera later than is believed, or gains too high for them"
_PUSHED = "this trial's push was harder than safety.load and safety.follow_deg allow, or went across the plane"
_OBLIQUE = "the camera does not look square at the plane: calibrate it, then --optics"
# Share of a camera's angle off square that it may show a bend in the plane as one across it.
_SLIGHTLY = 0.3
# Change from one frame to the next that no motion at rest makes.
JUMP = math.radians(2.0)


class Evidence(NamedTuple):
    """Evidence of the last moments; SI units."""

    turned: Array
    """Steps by which each spool was told to reel in, (4,)."""
    load: float
    across: float
    """Away from the camera."""
    bent: float
    meant: float
    """Bend of the wrist that its spools should have made; `bent` is the measured one."""
    jump: float
    """Largest change of the marker's angle from one frame to the next, off what the spools make."""
    bends: float
    """Bend across that is beyond the limit."""
    reversals: int = 0
    """Number of times that a spool has turned back."""
    pushed: bool = False
    """Whether a person pushes in this trial."""
    oblique: float = 0.0
    """How far off square an uncalibrated camera looks at the plane."""


def reversals(positions: Array) -> int:
    """Largest number of times that a spool of (n, 4) [steps] has turned back, by enough to count as turned."""
    return max(_turned_back(course) for course in positions.T.tolist())


def _turned_back(course: Sequence[float]) -> int:
    turns, sense, low, high = 0, 0, course[0], course[0]
    for position in course:
        low, high = min(low, position), max(high, position)
        if sense >= 0 and high - position >= TURNED:
            turns, sense, low = turns + sense, -1, position
        elif sense <= 0 and position - low >= TURNED:
            turns, sense, high = turns - sense, 1, position
    return turns


def likely_causes(evidence: Evidence, plus: Sequence[bool], away: Sequence[int]) -> list[str]:
    """Causes in words.

    A load toward one side means that a tendon of the other pulls less than its spool says, or one of the same side
    more. Of each pair the bend across tells which: it is away from a camera for a tendon that pulls too much on the
    far side, or too little on the near one.
    """
    swings = [_PUSHED] * evidence.pushed + [LOOP_SWINGS] * (evidence.reversals >= SWINGS)
    if abs(evidence.across) > 0.5 * evidence.bends and evidence.jump <= JUMP:
        slight = abs(evidence.across) < _SLIGHTLY * evidence.oblique
        return [*swings, *[_OBLIQUE] * slight, *_of_one_tendon(evidence, plus, away)]
    causes, meant = swings, abs(evidence.meant) > MEANT
    if evidence.jump > JUMP:
        causes += ["the tip's marker has slipped on its disc", "the camera shows or dates pictures wrongly"]
    share = evidence.bent / evidence.meant if meant else math.nan
    if abs(share) < 0.15:
        causes.append("the motors have no supply")
    if share < 0.15:
        causes.append("both motors of a side turn the wrong way, are stuck, or are exchanged with the other side's")
    turning = bool((abs(evidence.turned) > TURNED).any())
    if meant and share >= 0.15:
        much = "more" if share > 1.0 else "less"
        causes.append(f"the wrist bends by {much} than its spools say: wrong pulley or microsteps (DIP switches)")
    if turning:
        causes.append("motors exchanged, detached or slipped tendons on a side, or a stalled motor")
    else:
        causes.append("a side's tendons slipped or came off, or the motors' supply was lost")
    if evidence.jump <= JUMP:
        causes += ["the camera shows old pictures", "the tip's marker has slipped on its disc"]
    return [*dict.fromkeys(causes), *["something holds or pushes the wrist"] * (not evidence.pushed)]


def _of_one_tendon(evidence: Evidence, plus: Sequence[bool], away: Sequence[int]) -> list[str]:
    far, toward_plus = evidence.across > 0.0, evidence.load > 0.0
    much = next(k for k in range(4) if plus[k] == toward_plus and (away[k] > 0) == far)
    little = next(k for k in range(4) if plus[k] != toward_plus and (away[k] > 0) != far)
    named = {axis: f"axis {axis} (tendon {ACTIVE[axis]})" for axis in (much, little)}
    causes = []
    if evidence.turned[much] < -TURNED:
        causes.append(f"{named[much]} turns the wrong way, or its direction is stuck")
    if evidence.turned[little] > TURNED:
        causes.append(f"{named[little]} turns the wrong way")
    if abs(evidence.turned[much]) > TURNED or abs(evidence.turned[little]) > TURNED:
        causes.append("motors exchanged")
    causes.append(f"the tendon of {named[little]} is off its pulley")
    causes.append(f"it has slipped on it, or that of {named[much]} has")
    if abs(evidence.turned[little]) > TURNED:
        causes.append(f"{named[little]} has stalled or has no power")
    return [*causes, *["something pushes the wrist across its plane"] * (not evidence.pushed)]
