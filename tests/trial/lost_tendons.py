"""Motors that no longer move the wrist as they should, in trials in two planes: does any of them end well?

`python -m tests.trial.lost_tendons` tries what has not been tried yet, tells all, and writes
docs/hardware/lost-tendons.md: a tendon off its pulley, a motor that stalls and a drive at half its microsteps, of each
axis, over six motions. Exit code 1 where one went through.
"""

from __future__ import annotations

import argparse
import json
import sys
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from tests.trial.fault_runs import forked, injecting
from tests.trial.single_trials import Ended, performed
from wristctl.board.messages import AXES

PAGE = Path(__file__).parents[2] / "docs" / "hardware" / "lost-tendons.md"
DIAGONALS = "ulnar-flexion", "radial-flexion", "radial-extension", "ulnar-extension"
_PATHS: dict[str, dict[str, Any]] = {
    "circumduction": {"reference": {"kind": "circumduction", "angle_deg": 25.0, "turn": 4.0}, "horizon": 5.0},
    "dart-thrower": {"reference": {"kind": "dart-thrower", "angle_deg": 30.0, "turn": 1.5}, "horizon": 3.0},
    **{name: {"directions": (name,), "horizon": 3.0} for name in DIAGONALS},
}
MOTIONS = {name: {"planes": 2, **path} for name, path in _PATHS.items()}
FAULTS: dict[str, dict[str, Any]] = {
    "tendon off its pulley": {"kind": "tendon-detached"},
    "motor stalls": {"kind": "motor-stalled"},
    "drive at 1/8 microsteps": {"kind": "drive-rescaled", "size": 2.0},
}
AT = 0.2
"""When it happens: seconds after the motion has begun."""


def tried(motion: str, kept: Path, workers: int) -> list[tuple[str, str, int, Ended]]:
    """Each fault of each axis over a motion; what was tried before is not tried again."""
    cases = [(name, axis) for name in FAULTS for axis in range(AXES)]
    files = {case: kept / f"{motion}-{case[0].replace('/', ' of ')}-{case[1]}.json" for case in cases}
    if left := [case for case in cases if not files[case].is_file()]:
        changes = [injecting([{**FAULTS[name], "axis": axis, "at": AT, "since": "first trial"}]) for name, axis in left]
        run = partial(performed, MOTIONS[motion], at=AT)
        for number, ended in forked(run, changes, "first trial", AT, workers).items():
            files[left[number]].write_text(json.dumps(ended))
    return [
        (motion, name, axis, Ended(*json.loads(files[name, axis].read_text())))
        for name, axis in cases
        if files[name, axis].is_file()
    ]


def page(judged: list[tuple[str, str, int, Ended]]) -> str:
    """The table: a row for each fault, axis and motion."""
    through = sum(ended.outcome == "ok" for *_, ended in judged)
    lines = [
        "# Tendons that are lost in two planes", "",
        f"{len(judged)} trials on the emulated rig at 1.0 A, with a fault {AT:g} s after the motion began: {through}",
        "went through. A motion may ask nothing of the tendon that is lost: small moves after the trial find it then,",
        "and the trial does not count. Made by `make lost-tendons`.", "",
        "| motion | fault | axis | found | after [s] | true pull [N] | true error [deg] | reason |",
        "|---|---|---|---|---|---|---|---|",
    ]  # fmt: skip
    for motion, name, axis, ended in judged:
        where = "no" if ended.outcome == "ok" else "after the trial" if ended.outcome.startswith("after") else "in it"
        reason = (ended.odd if where == "no" else ended.outcome).removeprefix("after it: ").removeprefix("stopped: ")
        said = reason.partition("; likely")[0].replace("|", "/")
        lines.append(
            f"| {motion} | {name} | {axis} | {where} | {ended.after:.2f} | {ended.pull:.0f} "
            f"| {np.degrees(ended.error):.1f} | {said[:140]} |"
        )
    return "\n".join(lines) + "\n"


def main() -> int:
    """Try what is asked for; write the page where that is everything."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--motion", choices=MOTIONS, action="append", help="all unless named")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--kept", type=Path, default=Path("build/lost-tendons"), help="what was tried before is here")
    asked = parser.parse_args()
    asked.kept.mkdir(parents=True, exist_ok=True)
    judged = [each for motion in asked.motion or MOTIONS for each in tried(motion, asked.kept, asked.workers)]
    text = page(judged)
    if asked.motion is None:
        PAGE.write_text(text)
    print(text)
    return int(any(ended.outcome == "ok" for *_, ended in judged))


if __name__ == "__main__":
    sys.exit(main())
