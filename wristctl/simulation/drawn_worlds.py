"""The worlds of a family, drawn: each leaf, each world and each camera from a stream of its own.

Another leaf, reference or world changes nothing for those that were there. What is tuned on, chosen by and judged on
are draws of different names.
"""

from statistics import NormalDist

import numpy as np

from wristctl.config.families import TOGETHER, Family
from wristctl.config.loop import Loop, sample_period
from wristctl.config.wrist import WristParameters
from wristctl.seeds import Entropy, stream
from wristctl.simulation.cases import Case
from wristctl.simulation.homed_worlds import homed
from wristctl.simulation.motion import Motion
from wristctl.simulation.planes import Asked, motion_in, planes_of
from wristctl.wrist.kinematics import Inverse

# Names of the streams by which homing and the check of a rig err.
_HOMED = "homing", "check"
# By how much later than they were taken the check of a rig leaves pictures dated [s]: an age of less than 5 ms stays as
# it is, and what its model leaves out adds up to 3 to others (docs/hardware/camera.md).
_DATED_LATE = -3e-3, 5e-3
# A share at which no interval that is given in round numbers has its middle, an end, or a right angle.
_WITHIN = 0.382


def world_of(family: Family, name: str, split: str, seed: int, number: int) -> Loop:
    """The world of this number in a split."""
    keys = [*family.draw, *[TOGETHER] * bool(family.together)]
    return family.world({key: _share(stream(seed, _leaf(split, name, key)), number) for key in keys})


def believed_world_of(family: Family, name: str, split: str, seed: int, number: int, wrist: WristParameters) -> Loop:
    """`world_of`; of a family whose worlds are homed with what its controller then knows of it."""
    loop = world_of(family, name, split, seed, number)
    if not family.homed:
        return loop
    share, place = (_share(stream(seed, _leaf(split, name, key)), number) for key in _HOMED)
    error, (least, most) = NormalDist().inv_cdf(min(max(share, 1e-12), 1.0 - 1e-12)), _DATED_LATE
    return homed(wrist, loop, error, least + place * (most - least))


def streams_of(family: Family, name: str, split: str) -> list[str]:
    """The names of the streams that its worlds are drawn from."""
    numbers = range(len(family.references))
    leaves = [_leaf(split, name, key) for key in family.draw if not key.startswith("reference.")]
    leaves += [_leaf(split, name, key) for key in (TOGETHER,) * bool(family.together) + _HOMED * family.homed]
    motions = [
        _leaf(split, name, key, number) for key in family.draw for number in numbers if key in family.drawn_of(number)
    ]
    return [
        *leaves,
        *motions,
        *(_camera(split, name, number) for number in numbers if family.loop.sensor.level == "camera"),
    ]


def asked_of(family: Family) -> list[Asked]:
    """Loops and motions of a family: all that is drawn at its lower end, at its upper, within, and at every value.

    In one plane all angles count in the same, also those of tasks that people do in the other.
    """
    longest = max([len(family.together), *(len(some) for some in family.draw.values() if not isinstance(some, str))])
    places = [0.0, 1.0 - 1e-12, _WITHIN, *((k + 0.5) / longest for k in range(longest))]
    drawn = [dict.fromkeys([*family.draw, TOGETHER], share) for share in places]
    numbers = range(len(family.references))
    return [
        Asked(family.world(shares), family.motion(number, shares), "ulnar") for shares in drawn for number in numbers
    ]


def drawn_cases(
    family: Family, name: str, split: str, seed: int, draws: int, wrist: WristParameters,
    network: Inverse | None = None, first: int = 0, noises: int = 1,
) -> list[Case]:  # fmt: skip
    """Every reference in each of so many worlds from the `first` on, each as often as there are `noises`.

    The cases of a world follow one another, and those of a reference in it, which are a cell, differ in noise alone.
    All bend in two planes where any of the family leaves its plane.
    """
    planes = planes_of(wrist, asked_of(family))
    cases, motions, cell = list[Case](), dict[tuple[str, float], Motion](), 0
    for world in range(first, first + draws):
        loop = believed_world_of(family, name, split, seed, world, wrist)
        period = sample_period(loop.control_period)
        for number in range(len(family.references)):
            shares = {
                key: _share(stream(seed, _leaf(split, name, key, number)), world) for key in family.drawn_of(number)
            }
            reference = family.motion(number, shares)
            key = reference.model_dump_json(), period
            if key not in motions:
                motions[key] = motion_in(planes, reference, None, wrist, family.horizon, period, network)
            noise = *stream(seed, _camera(split, name, number)), world
            cases += [Case(loop, motions[key], (*noise, k) if k else noise, cell) for k in range(noises)]
            cell += 1
    return cases


def _leaf(split: str, name: str, key: str, number: int | None = None) -> str:
    return f"{split} {name}: {key}" + ("" if number is None else f" of {number}")


def _camera(split: str, name: str, number: int) -> str:
    return f"{split} {name}: camera of {number}"


def _share(entropy: Entropy, number: int) -> float:
    return float(np.random.default_rng((*entropy, number)).random())
