"""Numbers that every machine of a study must come to: short rollouts of its laws on its kinds of worlds, as one hash.

All that the study will run is compiled by them.
"""

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np

from wristctl.config.families import Family
from wristctl.config.loop import Loop, Reference, sample_period
from wristctl.config.wrist import WristParameters
from wristctl.control.law import Controller
from wristctl.control.table import controller
from wristctl.simulation.drawn_worlds import world_of
from wristctl.simulation.planes import motion_in
from wristctl.simulation.rollout import rollout, structure

# As a unit of work names it.
GOLDEN = "wristctl.simulation.golden:golden"
_TICKS, _LANES, _DRAWN = 40, 16, 40


def golden_spec(
    laws: Iterable[str], loops: Iterable[Loop], wrist: WristParameters, planes: Iterable[int] = (1,)
) -> dict[str, Any]:
    """Runs of `golden`: one loop of each structure with the first law, and the first loop with each law.

    They bend in each of these numbers of planes.
    """
    kinds = {structure(loop): loop for loop in loops}
    return {
        "laws": list(laws),
        "loops": [json.loads(loop.model_dump_json(by_alias=True)) for loop in kinds.values()],
        "wrist": json.loads(wrist.model_dump_json(by_alias=True)),
        "planes": sorted(set(planes)),
    }


def kinds_of_worlds(families: Mapping[str, Family], names: Iterable[str], seed: int) -> list[Loop]:
    """A world of every kind that the first of each family are."""
    drawn = [world_of(families[name], name, "test", seed, number) for name in names for number in range(_DRAWN)]
    return list({structure(loop): loop for loop in drawn}.values())


def golden(spec: Mapping[str, Any]) -> str:
    """SHA-256 of the metrics of these rollouts."""
    wrist = WristParameters.model_validate_json(json.dumps(spec["wrist"]))
    loops = [Loop.model_validate_json(json.dumps(spec_loop)) for spec_loop in spec["loops"]]
    digest, laws = hashlib.sha256(), [controller(name) for name in spec["laws"]]
    pairs = [*((laws[0], case) for case in loops), *((case, loops[0]) for case in laws[1:])]
    for planes, (law, loop) in product(spec["planes"], pairs):
        digest.update(_numbers(law, loop, wrist, planes).tobytes())
    return digest.hexdigest()


def _numbers(law: Controller, loop: Loop, wrist: WristParameters, planes: int) -> np.ndarray:
    period = sample_period(loop.control_period)
    followed = motion_in(planes, Reference(kind="step"), None, wrist, _TICKS * period, period)
    outcome = rollout(
        law, np.tile(_gains(law), (_LANES, 1)), [followed], np.zeros(_LANES, np.int64), loop, wrist,
        streams=[(lane,) for lane in range(_LANES)], record=True, threads=1,
    )  # fmt: skip
    assert outcome.samples is not None
    return np.nan_to_num(outcome.samples)


def _gains(law: Controller) -> Sequence[float]:
    return law.values(next(iter(law.presets.values()))) if law.presets else ()
