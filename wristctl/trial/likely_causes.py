"""Why a wrist does not do what its motors do, the likeliest first."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from wristctl.arrays import Array
from wristctl.wrist.directions import ACTIVE

_TURNED = 40.0
"""Steps in the time looked at from which a motor has turned."""
_MEANT = math.radians(2.0)
"""Bend in that time from which the wrist was meant to move."""
_SWINGS = 3
"""Turnings back, in the time looked at for them, from which a loop swings: a motion there and back has one."""
_SWINGING = "the loop swings: friction in the sheaths, a camera later than is believed, or gains too high for them"
_JUMP = math.radians(2.0)
"""Change from one frame to the next that no motion at rest makes."""


class Evidence(NamedTuple):
    """What the last moments have shown; SI units."""

    turned: Array
    """Steps by which each spool was told to reel in, (4,)."""
    load: float
    across: float
    """Away from the camera."""
    bent: float
    meant: float
    """By how much the wrist has bent, and should have by its spools."""
    jump: float
    """Largest change of the marker's angle from one frame to the next, off what the spools make."""
    bends: float
    """Bend across that is beyond the limit."""
    reversals: int = 0
    """How often a spool has turned back."""


def reversals(positions: Array) -> int:
    """How often any spool (n, 4) [steps] has turned back by so much that it has turned."""
    return max(_turned_back(course) for course in positions.T.tolist())


def _turned_back(course: Sequence[float]) -> int:
    found, sense, low, high = 0, 0, course[0], course[0]
    for at in course:
        low, high = min(low, at), max(high, at)
        if sense >= 0 and high - at >= _TURNED:
            found, sense, low = found + sense, -1, at
        elif sense <= 0 and at - low >= _TURNED:
            found, sense, high = found - sense, 1, at
    return found


def likely_causes(seen: Evidence, plus: Sequence[bool], away: Sequence[int]) -> list[str]:
    """Causes in words.

    A load toward one side means that a tendon of the other pulls less than its spool says, or one of the same side
    more. Of each pair the bend across tells which: it is away from a camera for a tendon that pulls too much on the
    far side, or too little on the near one.
    """
    swings = [_SWINGING] if seen.reversals >= _SWINGS else []
    if abs(seen.across) > 0.5 * seen.bends and seen.jump <= _JUMP:
        return [*swings, *_of_one_tendon(seen, plus, away)]
    causes, meant = swings, abs(seen.meant) > _MEANT
    if seen.jump > _JUMP:
        causes += ["the tip's marker has slipped on its disc", "the camera shows or dates pictures wrongly"]
    share = seen.bent / seen.meant if meant else math.nan
    if abs(share) < 0.15:
        causes.append("the motors have no supply")
    if share < 0.15:
        causes.append("both motors of a side turn the wrong way, are stuck, or are exchanged with the other side's")
    turning = bool((abs(seen.turned) > _TURNED).any())
    if meant and share >= 0.15:
        much = "more" if share > 1.0 else "less"
        causes.append(f"the wrist bends by {much} than its spools say: wrong pulley or microsteps (DIP switches)")
    if turning:
        causes.append("motors exchanged, detached or slipped tendons on a side, or a stalled motor")
    else:
        causes.append("a side's tendons slipped or came off, or the motors' supply was lost")
    if seen.jump <= _JUMP:
        causes += ["the camera shows old pictures", "the tip's marker has slipped on its disc"]
    return [*dict.fromkeys(causes), "something holds or pushes the wrist"]


def _of_one_tendon(seen: Evidence, plus: Sequence[bool], away: Sequence[int]) -> list[str]:
    far, toward_plus = seen.across > 0.0, seen.load > 0.0
    much = next(k for k in range(4) if plus[k] == toward_plus and (away[k] > 0) == far)
    little = next(k for k in range(4) if plus[k] != toward_plus and (away[k] > 0) != far)
    named = {axis: f"axis {axis} (tendon {ACTIVE[axis]})" for axis in (much, little)}
    causes = []
    if seen.turned[much] < -_TURNED:
        causes.append(f"{named[much]} turns the wrong way, or its direction is stuck")
    if seen.turned[little] > _TURNED:
        causes.append(f"{named[little]} turns the wrong way")
    if abs(seen.turned[much]) > _TURNED or abs(seen.turned[little]) > _TURNED:
        causes.append("motors exchanged")
    causes.append(f"the tendon of {named[little]} is off its pulley")
    causes.append(f"it has slipped on it, or that of {named[much]} has")
    if abs(seen.turned[little]) > _TURNED:
        causes.append(f"{named[little]} has stalled or has no power")
    return [*causes, "something pushes the wrist across its plane"]
