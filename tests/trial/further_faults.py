"""Faults beyond the table of fault_cases: such as creep, cancel each other, come again and again, or are small.

A run with one of them may be stopped or go through. Whichever it is, no tendon pulls beyond the motors' current, and
a run that goes through says what was odd or went as a sound one: `python -m tests.trial.further_faults` tells all, and
writes docs/hardware/fault-table.md where it has tried them all.
"""

from __future__ import annotations

import argparse
import itertools
import json
import pickle
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tests.trial.fault_cases import EITHER, PHASES, Case, Phase
from tests.trial.fault_judging import Judged
from tests.trial.fault_runs import fan_out, from_power_on, sound_course

PAGE = Path(__file__).parents[2] / "docs" / "hardware" / "fault-table.md"
STEP = 1e-3 * 0.0147262
"""Tendon per microstep [m]: a pulley of 7.5 mm, 3,200 steps per turn."""
CURRENT, BESIDE = 42.7, 1.0
"""True pull [N] that the emulated motors hold, and by how much one may exceed it: a millisecond of motion, a push."""


def _on(*axes: int) -> tuple[dict[str, Any], ...]:
    return tuple({"axis": axis} for axis in axes)


def _again(every: float, count: int, **more: Any) -> tuple[dict[str, Any], ...]:
    return tuple({"at": every * k, **more} for k in range(1, count))


def _steps(rate: float) -> float:
    """Millimetres of tendon per second of so many steps per second that nobody counts, as `tendon-creeps` has them."""
    return -1e3 * STEP * rate


def _case(name: str, kind: str, size: float = 1.0, **more: Any) -> Case:
    return Case(name, kind, size, ends=EITHER, **{"shows": "at once", **more})


FURTHER = (
    # pulls that cancel each other: they bend nothing
    _case("100 uncounted steps/s, all motors", "tendon-creeps", _steps(100), parts=_on(1, 2, 3)),
    _case("40 uncounted steps/s, motors 0 and 3", "tendon-creeps", _steps(40), parts=_on(3)),
    _case("40 uncounted steps/s, motors 1 and 2", "tendon-creeps", _steps(40), axis=1, parts=_on(2)),
    _case("all tendons tighten by 1 mm/s", "tendon-creeps", -1.0, parts=_on(1, 2, 3)),
    _case("all tendons shorter by 1 mm", "tendon-slipped", -1.0, parts=_on(1, 2, 3)),
    _case("all tendons shorter by 0.3 mm", "tendon-slipped", -0.3, parts=_on(1, 2, 3)),
    # one tendon or motor
    _case("40 uncounted steps/s, motor 2", "tendon-creeps", _steps(40), axis=2),
    _case("tendon 2 slips by 1 mm/s", "tendon-creeps", 1.0, axis=2),
    _case("tendon 2 slips by 0.1 mm/s", "tendon-creeps", 0.1, axis=2),
    _case("tendons 2 and 3 slip by 0.5 mm/s", "tendon-creeps", 0.5, axis=2, parts=_on(3)),
    _case("tendon 2 caught, 1.5 mm", "tendon-slipped", -1.5, axis=2),
    _case("drive 2: twice the way", "drive-rescaled", 2.0, axis=2),
    _case("drive 2: half the way", "drive-rescaled", 0.5, axis=2),
    _case("drive 2: a tenth of its steps lost", "drive-rescaled", 0.9, axis=2),
    _case("motors 0 and 1 exchanged", "motors-exchanged", 1.0),
    _case("motors 0 and 2 exchanged", "motors-exchanged", 2.0),
    _case("supply sags: 3 N", "torque-lost", 3.0),
    _case("supply sags: 5 N", "torque-lost", 5.0),
    _case("board resets, supply off", "board-reset", parts=({"kind": "supply-off"},)),
    Case("no torque at 1500 steps/s", bench={"motors": {"top_speed": 1500.0}}, ends=EITHER),
    Case("pulleys +14 %", bench={"motors": {"step_scale": (1.14,) * 4}}, ends=EITHER),
    Case("pulleys -12 %", bench={"motors": {"step_scale": (0.88,) * 4}}, ends=EITHER),
    # what the camera sees
    _case("marker peels by 2 deg/s", "marker-peels", 2.0),
    _case("marker peels by 0.3 deg/s", "marker-peels", 0.3),
    _case("marker askew by 4 deg", "marker-turned", 4.0),
    _case("camera bumped", "picture-turned", 3.0, parts=({"kind": "picture-shifted", "size": 12.0},)),
    _case("camera sags by 4 px/s", "picture-shifted", 1.0, parts=_again(0.25, 12)),
    _case("a hand 120 of 400 ms", "marker-covered", duration=0.12, parts=_again(0.4, 8)),
    _case("the marker flaps, 30 of 80 ms", "marker-covered", duration=0.03, parts=_again(0.08, 40)),
    _case("pictures 60 ms late", "pictures-late", 0.06),
    _case("pictures later by 30 ms/s", "pictures-late", 0.003, parts=_again(0.1, 30)),
    _case("stamps jump by 20 ms", "stamps-shifted", 0.02, duration=0.05, parts=_again(0.1, 25)),
    # computer and link
    _case("pauses of 45 ms, 5/s", "host-pause", 45.0, duration=0.1, parts=_again(0.2, 15)),
    _case("a pause of 300 ms", "host-pause", 300.0),
    _case("a pause of 3 s", "host-pause", 3000.0),
    _case("hub: answers 15 ms late at times", "answers-held", 15.0, duration=0.05, parts=_again(0.2, 12)),
    _case("hub: answers 40 ms late at times", "answers-held", 40.0, duration=0.05, parts=_again(0.3, 8)),
    _case("a bit in 1,000 bytes", "bytes-garbled", 1e-3),
    # two at once
    _case("motors 0 and 2 exchanged, hub", "motors-exchanged", 2.0,
          parts=({"kind": "answers-held", "size": 40.0, "duration": 0.05},)),
    _case("all tendons shorter by 1 mm, covered", "tendon-slipped", -1.0,
          parts=(*_on(1, 2, 3), {"kind": "marker-covered", "duration": 0.1})),
    _case("slip of 1 mm/s, half of the frames", "tendon-creeps", 1.0, axis=2,
          parts=({"kind": "frames-thinned", "size": 2.0},)),
    _case("uncounted steps, all motors, late pictures", "tendon-creeps", _steps(100),
          parts=(*_on(1, 2, 3), {"kind": "pictures-late", "size": 0.03})),
)  # fmt: skip
INJECTED, BUILT = [case for case in FURTHER if case.kind], [case for case in FURTHER if not case.kind]

SILENT = {
    "all tendons shorter by 0.3 mm": "6 N more in every tendon: slack when all are let out by 0.6 mm to look for pulls",
    "drive 2: a tenth of its steps lost": "5 N more in one tendon: a tenth of few steps is within what homing allows",
    "pulleys -12 %": "so many more steps for a radian are within what homing allows, and the camera leads the wrist",
}
"""Cases that may go through with nothing odd though the wrist was not as a sound one, and why."""


def wrong(judged: Sequence[Judged]) -> list[tuple[Judged, str]]:
    """What did not end as it should: a pull beyond the motors' current, or a run that went through in silence."""
    found = []
    for each in judged:
        if each.pull > CURRENT + BESIDE:
            found.append((each, f"{each.pull:.0f} N"))
        elif each.end == "tolerated" and not each.said and each.name not in SILENT:
            found.append((each, "went through, and said nothing"))
    return found


def page(judged: Sequence[Judged]) -> str:
    """The table: a row for each fault and moment."""
    caught = sum(each.end == "caught" for each in judged)
    odd = sum(each.end == "tolerated" and bool(each.said) for each in judged)
    silent = sum(each.end == "tolerated" and not each.said for each in judged)
    most = max(each.pull for each in judged)
    alike = len(judged) - caught - odd - silent
    left = len(PHASES) * len(INJECTED) + 2 * len(BUILT) - len(judged)
    lines = [
        "# Faults that creep, cancel each other or come again",
        "",
        f"{len(judged)} runs on the emulated rig, motors at 1.0 A (42.7 N): {caught} were stopped, {odd} went through",
        f"and said what was odd, {silent} said nothing and {alike} went as a sound run does. The largest true pull was",
        f"{most:.0f} N. These come beside the [table of all faults](faults.md#every-fault-tried).",
        "Made by `make fault-table`" + (f"; {left} more runs of it have not been made yet." if left else "."),
        "",
        "| fault | when | end | after [ms] | true pull [N] | true error [deg] | reason, or what was odd |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for each in judged:
        after = "" if np.isnan(each.seconds) else f"{1e3 * each.seconds:.0f}"
        quiet = each.end == "tolerated" and not each.said
        end = (
            "ok, silent"
            if quiet
            else {"caught": "stopped", "tolerated": "ok, odd", "no effect": "ok, as sound"}[each.end]
        )
        why = SILENT.get(each.name, "") if quiet else each.said
        said = why.removeprefix("stopped: ").partition("; likely")[0].replace("|", "/")
        lines.append(
            f"| {each.name} | {each.phase} | {end} | {after} | {each.pull:.0f} | {each.error:.1f} | {said[:160]} |"
        )
    return "\n".join(lines) + "\n"


def tried(phase: Phase, kept: Path, first: int, count: int, workers: int) -> list[Judged]:
    """Try some of the injected faults of a phase, and keep how each ended."""
    cases = [case for case in INJECTED[first : first + count] if not _file(kept, case, phase).is_file()]
    for case, judged in zip(cases, fan_out(phase, [[case] for case in cases], workers) if cases else (), strict=True):
        _file(kept, case, phase).write_bytes(pickle.dumps(judged))
    return [pickle.loads(_file(kept, case, phase).read_bytes()) for case in INJECTED[first : first + count]]


def _in_order(judged: Sequence[Judged]) -> list[Judged]:
    """As the list of faults has them, and by phase."""
    names = [case.name for case in FURTHER]
    return sorted(judged, key=lambda each: (names.index(each.name), PHASES.index(each.phase)))


def _file(kept: Path, case: Case, phase: Phase) -> Path:
    return kept / f"{phase}-{case.name.replace('/', ' per ')}.pickle"


def main() -> int:
    """Try what is asked for; write the page where that is everything."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--phase", choices=PHASES, action="append", help="moments; all unless named")
    parser.add_argument("--first", type=int, default=0, help="number of the first fault")
    parser.add_argument("--count", type=int, default=len(FURTHER), help="faults to try")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument(
        "--kept", type=Path, default=Path("build/fault-table"), help="what was tried before is kept here"
    )
    parser.add_argument("--page", action="store_true", help="only write the page, of what was tried")
    asked = parser.parse_args()
    asked.kept.mkdir(parents=True, exist_ok=True)
    phases: Sequence[Phase] = asked.phase or PHASES
    if asked.page:
        PAGE.write_text(page(_in_order([pickle.loads(file.read_bytes()) for file in asked.kept.glob("*.pickle")])))
        return 0
    judged = [each for phase in phases for each in tried(phase, asked.kept, asked.first, asked.count, asked.workers)]
    whole = (tuple(phases), asked.first, asked.count) == (PHASES, 0, len(FURTHER))
    for case, phase in itertools.product(BUILT if whole else (), ("homing", "moving")):
        file = _file(asked.kept, case, phase)  # type: ignore[arg-type]
        if not file.is_file():
            sound_course(phase)
            file.write_bytes(pickle.dumps(from_power_on(case, phase)))  # type: ignore[arg-type]
        judged.append(pickle.loads(file.read_bytes()))
    text = page(judged := _in_order(judged))
    if whole:
        PAGE.write_text(text)
    print(text)
    failed = wrong(judged)
    print(json.dumps([[each.name, each.phase, why] for each, why in failed], indent=1))
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
