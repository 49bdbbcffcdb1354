"""How fast tensions cross their range: `python docs/chattering.py` writes docs/chattering.md (minutes).

Every controller with every preset on six loops, three motions and two wrists. Fails where a loop lies near the limit
above which it is said to chatter.
"""

from __future__ import annotations

import sys
import textwrap
from collections import Counter
from pathlib import Path
from typing import NamedTuple

import numpy as np

from wristctl.comparison.combinations import ComparedRow, compare
from wristctl.config.controller_row import Row
from wristctl.config.loop import LOOPS, Loop, Reference
from wristctl.config.study import Study
from wristctl.control.table import CONTROLLERS, controller
from wristctl.simulation.oscillation import FASTEST
from wristctl.study_files.load import load_study

PAGE = Path(__file__).parent / "chattering.md"
LENGTHS = (0.08, 0.12)
RIG = {"control_period": 5e-3, "actuator": {"level": "tendon"}, "sensor": {"level": "camera"}}
ON = {
    "exact": LOOPS["exact"],
    "sampled": LOOPS["sampled"],
    "four-segments": LOOPS["four-segments"],
    "camera": Loop.model_validate({"sensor": {"level": "camera"}}),
    "5 ms, lagged": Loop.model_validate({"control_period": 5e-3, "actuator": {"level": "lagged"}}),
    "motors, tendons, camera": Loop.model_validate(RIG),
}
REFERENCES = (Reference(kind="step"), Reference(), Reference(kind="sine"))
NEAR = 0.5, 1.1
"""Times the limit, between which no loop may lie: the slowest are lagged motors at 5 ms, which soften what they do."""


class Swings(NamedTuple):
    """A rollout that stays within its range: how often its tensions go from limit to limit and back [1/s]."""

    loop: str
    row: str
    rate: float


def asked(length: float) -> Study:
    """All rows on all loops, of a wrist of this length [m]."""
    laws = [controller(name) for name in CONTROLLERS if not controller(name).plain]
    rows = tuple(Row(controller=law.name, gains=preset) for law in laws for preset in law.presets or ("default",))
    study = load_study([], [f"wrist.length={length}"])
    chosen = {"rows": rows, "loops": ON, "references": REFERENCES, "inverses": ("none",)}
    return study.model_copy(update={"compare": study.compare.model_copy(update=chosen)})


def measured() -> list[Swings]:
    """All of them."""
    found = []
    for length in LENGTHS:
        study = asked(length)
        whole = 4.0 * study.wrist.tension_range
        found += [Swings(each.loop, each.label, _rate(each, whole)) for each in compare(study) if not _failed(each)]
    return found


def _failed(row: ComparedRow) -> bool:
    return bool(row.repeated.failed.any())


def _rate(row: ComparedRow, whole: float) -> float:
    return float(np.median(row.repeated.metrics["chattering"])) / whole


def page(found: list[Swings]) -> str:
    """The page."""
    calm, slams = ([each for each in found if (each.rate > FASTEST) == above] for above in (False, True))
    most, least = max(each.rate for each in calm), min(each.rate for each in slams)
    said = f"""Of {len(found)} rollouts that stay within their range {len(slams)} are said to chatter: their tensions go
    from limit to limit and back more than {FASTEST:g} times a second. The fastest of the others do so {most:.2g} times,
    the slowest of these {least:.3g} times; nothing lies between."""
    rows, lengths = len({each.row for each in found}), " and ".join(f"{1e3 * each:g}" for each in LENGTHS)
    made = f"""Made by `python docs/chattering.py`: {rows} rows, each a controller with a preset, a step, a minimum jerk
    and a sine of 30 deg, wrists of {lengths} mm. [What is counted](worlds.md#chattering)."""
    lines = ["# Chattering: how fast tensions cross their range", ""]
    lines += [*textwrap.wrap(" ".join(said.split()), 120), "", *textwrap.wrap(" ".join(made.split()), 120), ""]
    lines += [
        "| loop | fastest without the mark [1/s] | which | marked | from [1/s] | to [1/s] | most often |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for loop in ON:
        fastest = max((each for each in calm if each.loop == loop), key=lambda each: each.rate)
        own = [each for each in slams if each.loop == loop]
        ends = f"{min(each.rate for each in own):.3g} | {max(each.rate for each in own):.3g}" if own else "- | -"
        often = ", ".join(f"{row} ({times})" for row, times in Counter(each.row for each in own).most_common(2))
        lines.append(f"| {loop} | {fastest.rate:.2g} | {fastest.row} | {len(own)} | {ends} | {often or '-'} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    every = measured()
    PAGE.write_text(page(every))
    sys.exit(any(NEAR[0] * FASTEST < each.rate < NEAR[1] * FASTEST for each in every))
