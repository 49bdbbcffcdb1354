"""Likely causes of a wrist that does not do what its motors do, in words, likeliest first: of P planes and T tendons.

Where the wrist is off its motors is a direction in the plane of bends. A tendon that is lost leaves a load away from
its place, one that pulls too much a load toward it; motors that are exchanged leave one along the line between their
places; a push comes from anywhere. One camera sees one component of that direction, and of the other its side, by the
size of the marker: without that, it tells the two sides of its plane, and no single tendon of two.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.trial.rig_belief import TOWARD, unit_toward
from wristctl.trial.rig_words import LOST, Words

# Steps in the time looked at from which a motor has turned.
TURNED = 40.0
# Bend in that time from which the wrist was meant to move.
MEANT = math.radians(2.0)
# Turnings back, in the time looked at for them, from which a loop swings: a motion there and back has one.
SWINGS = 3
LOOP_SWINGS = "the loop swings: friction in the sheaths, a sensor later than is believed, or gains too high for them"
# Change from one frame to the next that no motion at rest makes.
JUMP = math.radians(2.0)
_PUSHED = "this trial's push was harder than safety.load and safety.follow_deg allow"
_ACROSS = ", or went across the plane"
_OBLIQUE = "the camera does not look square at the plane: calibrate it, then --optics"
# Share of a camera's angle off square that it may show a bend in the plane as one across it.
_SLIGHTLY = 0.3
# Shares of the meant bend: below the first the wrist stood; nearer to 1 than the second it did what its motors did.
_STOOD, _SCALED = 0.15, 0.2
# A load this far off a tendon's direction [rad] may still be that tendon's doing.
_ASIDE = math.radians(28.0)
# Least share of the load that the lost pull must account for.
_ACCOUNTS = 0.4
# Share of one camera's jump below which the other one saw none.
_ALONE = 0.3
# Cosine from which a tendon is on the side of a direction.
_SIDE = 0.3


class Evidence(NamedTuple):
    """Evidence of the last moments; SI units. Pairs are toward ulnar and flexion, zero where no sensor tells."""

    turned: Array
    """Steps by which each spool was told to reel in, (T,)."""
    torque: Array
    """Torque with which each tendon should bend the straight wrist, by its spool, (T,)."""
    load: Array
    """(2,)"""
    apart: Array
    """Bend less what the spools should have made of it, (2,)."""
    across: Array
    """Bend across the plane of a single camera by the size of its marker, (2,); zero of two."""
    bent: Array
    """Measured change of the bend, (2,)."""
    meant: Array
    """Change of the bend that the spools should have made, (2,)."""
    jump: Array
    """Largest change of each sensor's angle from one frame to the next, off what the spools make, (P,)."""
    directions: Array
    """Direction in which each tendon bends the wrist, from ulnar toward flexion, (T,) [rad]."""
    words: Words
    bends: float = math.inf
    """Bend across that is beyond the limit."""
    oblique: float = 0.0
    """How far off square an uncalibrated camera looks at the plane."""
    reversals: int = 0
    """Number of times that a spool has turned back."""
    pushed: bool = False
    """Whether a person pushes in this trial."""

    @property
    def jumps(self) -> bool:
        """Whether a sensor jumped, and no other one beside it."""
        one, *others = sorted(self.jump.tolist(), reverse=True)
        return one > JUMP and all(other < _ALONE * one for other in others)

    @property
    def aside(self) -> bool:
        """Whether the wrist has left the plane of its only camera: one whose marker jumps tells no size."""
        return math.hypot(*self.across) > 0.5 * self.bends and not self.jumps

    @property
    def off(self) -> Array:
        """Direction in which the wrist is off its motors, a unit vector (2,) or zero: of the load, without one of the
        bend. With a bend across, of which the size is not told, it is the quadrant of both."""
        load = _unit(self.load) if self.load.any() else _unit(self.apart)
        return _unit(load + _unit(self.across)) if self.aside else load


def reversals(positions: Array) -> int:
    """Largest number of times that a spool of (n, T) [steps] has turned back, by enough to count as turned."""
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


def likely_causes(evidence: Evidence) -> list[str]:
    """Causes in words."""
    alone, words = len(evidence.jump) == 1, evidence.words
    causes = [_PUSHED + _ACROSS * alone] * evidence.pushed + [LOOP_SWINGS] * (evidence.reversals >= SWINGS)
    if evidence.jumps:
        plane = int(np.argmax(evidence.jump))
        causes += [words.slipped[plane], words.wrong[plane]]
    if math.hypot(*evidence.across) < _SLIGHTLY * evidence.oblique and evidence.aside:
        causes.append(_OBLIQUE)
    if not evidence.aside:
        causes += _of_all_motors(evidence)
    causes += _by_direction(evidence)
    if not evidence.pushed and (alone or not evidence.jumps):  # a blow makes two sensors jump
        causes.append(f"something pushes the wrist{_toward(evidence.off)}, or holds it")
    return list(dict.fromkeys(causes))


def _unit(vector: Array) -> Array:
    size = math.hypot(*vector)
    return vector / size if size > 1e-9 else np.zeros(2)


def _of_all_motors(evidence: Evidence) -> list[str]:
    """Causes that all motors share, by the share of the meant bend that was made."""
    meant = math.hypot(*evidence.meant)
    share = float(evidence.bent @ evidence.meant) / meant**2 if meant > MEANT else math.nan
    if abs(share) < _STOOD:
        return [f"the motors have no supply, or {evidence.words.old}"]
    if share < 0.0:
        return ["the wrist goes the other way than its motors: motors that turn the wrong way or are exchanged"]
    return []


def _scaled(evidence: Evidence) -> list[str]:
    """Said of a wrist that bends where its motors bend it, by more or by less."""
    meant = math.hypot(*evidence.meant)
    if meant <= MEANT:
        return []
    share = float(evidence.bent @ evidence.meant) / meant**2
    beside = math.hypot(*(evidence.bent - share * evidence.meant)) / meant
    if share < _STOOD or abs(share - 1.0) < _SCALED or beside > math.tan(_ASIDE) * abs(share - 1.0):
        return []
    much = "more" if share > 1.0 else "less"
    return [f"the wrist bends by {much} than its spools say: {evidence.words.scale}"]


def _by_direction(evidence: Evidence) -> list[str]:
    off, motors = evidence.off, evidence.words.motors
    if not off.any():
        return _scaled(evidence)
    toward = np.stack([np.cos(evidence.directions), np.sin(evidence.directions)], axis=1) @ off
    much, little = int(np.argmax(toward)), int(np.argmin(toward))
    moved = bool((np.abs(evidence.turned[[much, little]]) > TURNED).any())
    lost, more = list[str](), list[str]()
    if evidence.aside or len(evidence.jump) > 1:  # else two tendons of a side are not told apart
        if -float(toward[little]) >= math.cos(_ASIDE):
            lost = [LOST.format(f"the tendon of {motors[little]}")]
            lost += [f"{motors[little]} turns the wrong way"] * bool(evidence.turned[little] > TURNED)
        if float(toward[much]) >= math.cos(_ASIDE):
            more = [f"{motors[much]} turns the wrong way, or its tendon is caught"]
    if lost or more:
        carries = float(evidence.torque[little]) >= _ACCOUNTS * math.hypot(*evidence.load)
        first, second = (lost, more) if carries or evidence.turned[much] >= -TURNED else (more, lost)
        return [*first, *["motors exchanged"] * moved, *second]
    plus, minus = (_tendons(evidence.words, sign * toward) for sign in (1.0, -1.0))
    exchanged = [f"motors of {plus} exchanged with those of {minus}"] * bool(plus and minus)
    motor = f"a motor of {minus}" if minus else "a motor"
    stalled = f"{motor} has stalled or no power, or a tendon has slipped or come off"
    return [*_scaled(evidence), *exchanged, stalled]


def _tendons(words: Words, toward: Array) -> str:
    numbers = [str(number) for number, along in zip(words.numbers, toward, strict=True) if along > _SIDE]
    return f"tendon{'s' * (len(numbers) > 1)} {' and '.join(numbers)}" if numbers else ""


def _toward(unit: Array) -> str:
    if not unit.any():
        return ""
    name = max(TOWARD, key=lambda name: float(unit_toward(TOWARD[name]) @ unit))
    return f" toward {name.replace('-', ' and ')}"
