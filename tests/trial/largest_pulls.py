"""How hard does a tendon truly pull when one motor fails, or something holds the wrist, at either current?

`python -m tests.trial.largest_pulls` tries what has not been tried yet and writes
docs/hardware/largest-pulls.md: every kind of fault of one motor on each axis, motors exchanged by pairs, hands and an
edge, over a motion in one plane and three in two, and a load that the hand takes up. Exit code 1 where a bound is
missed.
"""

from __future__ import annotations

import argparse
import itertools
import math
import sys
import textwrap
from collections.abc import Callable, Mapping
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tests.drawn_rigs import COMMITTED, Kept
from tests.trial import hands
from tests.trial.conftest import WRIST
from tests.trial.fault_runs import Prepared, forked, injecting, over
from tests.trial.lost_tendons import MOTIONS
from tests.trial.single_trials import Ended, performed
from wristctl.board.messages import AXES
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.trial.motion_limit import borne, held_pull, reeled_unseen

PAGE = Path(__file__).parents[2] / "docs" / "hardware" / "largest-pulls.md"
CURRENTS: dict[str, dict[str, Any]] = {
    "1.0 A": {},
    "2.4 A": {"bench": {"motors": {"holding_torque": 0.76}}, "safety": {"motor_pull": 100.0}},
}
"""As the table of docs/hardware/rig.md has them, and said as it asks."""
TRIED: dict[str, tuple[dict[str, Any], float]] = {
    "ulnar": ({"directions": ("ulnar",), "horizon": 3.0}, 0.5),
    "circumduction": (MOTIONS["circumduction"], 1.0),
    "dart-thrower": (MOTIONS["dart-thrower"], 0.4),
    "dart-thrower in 3 s": (over(MOTIONS["dart-thrower"], {"reference": {"turn": 3.0}, "horizon": 6.0}), 0.8),
    "ulnar-flexion": (MOTIONS["ulnar-flexion"], 0.5),
}
"""Motions, the first in one plane, and when it happens: seconds after the motion has begun."""
MOST, MEDIAN = 55.0, 35.0
"""Largest pull at 2.4 A in motions that `hw-run` does not refuse there, and their median at 1.0 A [N]."""
PAYLOAD = 0.5
"""What the hand takes up [kg]."""
UNDECLARED = "more load than declared"
"""Words for one that nobody declared."""
WRISTS = {"upright": WristParameters(), "hanging": WristParameters(gravity=(9.81, 0.0))}

# One uncounted step a second reels in so many millimetres a second.
_STEP = 0.0147262
OF_ONE_MOTOR: dict[str, dict[str, Any]] = {
    "tendon off its pulley, or broken": {"kind": "tendon-detached"},
    "tendon slips by 5 mm": {"kind": "tendon-slipped", "size": 5.0},
    "tendon caught: 1.5 mm shorter": {"kind": "tendon-slipped", "size": -1.5},
    "motor stalls": {"kind": "motor-stalled"},
    "motor stalls for 100 ms": {"kind": "motor-stalled", "duration": 0.1},
    "drive without power": {"kind": "drive-off"},
    "drive at 1/8 microsteps": {"kind": "drive-rescaled", "size": 2.0},
    "drive at 1/32, or half of its steps lost": {"kind": "drive-rescaled", "size": 0.5},
    "pulley of a radius 14 % larger": {"kind": "drive-rescaled", "size": 1.14},
    "direction reversed": {"kind": "direction-flipped"},
    "direction stuck": {"kind": "direction-stuck"},
    "100 uncounted steps/s": {"kind": "tendon-creeps", "size": -100.0 * _STEP},
}
HANDS: dict[str, tuple[Callable[[], hands.Grip], float]] = {
    "a hand that holds hard for 1 s": (partial(hands.holding, 250.0), 1.0),
    "a hand that holds softly for 1 s": (partial(hands.holding, 60.0), 1.0),
    "a hand that holds on": (partial(hands.holding, 250.0), math.inf),
    "an edge 3 deg further on": (partial(hands.edge, math.radians(3.0), 300.0), math.inf),
}


class Case(NamedTuple):
    """What happens, with the axes that it has part in."""

    name: str
    axes: tuple[int, ...] = ()

    @property
    def named(self) -> str:
        """Both."""
        return self.name + "".join(f" {axis}" for axis in self.axes)

    def change(self, at: float) -> Prepared:
        """What makes it happen so long after the first trial began [s]."""
        if self.name in HANDS:
            grip, duration = HANDS[self.name]
            return partial(hands.lay_hand_on, grip=grip(), since=at, duration=duration)
        fault = OF_ONE_MOTOR.get(self.name)
        if fault is None:
            fault = {"kind": "motors-exchanged", "size": float(self.axes[1])}
        return injecting([{**fault, "axis": self.axes[0], "at": at, "since": "first trial"}])


CASES = (
    *(Case(name, (axis,)) for name in OF_ONE_MOTOR for axis in range(AXES)),
    *(Case("motors exchanged", pair) for pair in itertools.combinations(range(AXES), 2)),
    *(Case(name) for name in HANDS),
)
# A case's end by current and motion.
Table = Mapping[tuple[Case, str, str], Ended]


class Load(NamedTuple):
    """A load that the hand takes up: in which wrist, and whether it was declared."""

    wrist: str
    declared: bool

    @property
    def named(self) -> str:
        """Both."""
        return f"{self.wrist}, {'declared' if self.declared else 'undeclared'}"


# A load's end by current and motion.
Loads = Mapping[tuple[Load, str, str], Ended]
LOADS = tuple(Load(*each) for each in itertools.product(WRISTS, (True, False)))


def _key(of: Case | Load, current: str, motion: str) -> str:
    return f"{current}, {motion}: {of.named}"


def try_faults(current: str, motion: str, kept: Kept, workers: int) -> None:
    """A motion with each case that has not been tried before."""
    (settings, at), before = TRIED[motion], kept.all()
    if left := [case for case in CASES if _key(case, current, motion) not in before]:
        run = partial(performed, over(settings, CURRENTS[current]), at=at)
        for number, ended in forked(run, [each.change(at) for each in left], "first trial", at, workers).items():
            kept.add(_key(left[number], current, motion), ended)


def try_load(load: Load, current: str, motion: str, kept: Kept) -> None:
    """A motion in which the hand takes up a load, if it has not been tried before."""
    settings, at = TRIED[motion]
    if (key := _key(load, current, motion)) not in kept.all():
        declared = {"payload": PAYLOAD} if load.declared else {}
        taken = injecting([{"kind": "payload-taken", "size": PAYLOAD, "at": at, "since": "first trial"}])
        changes = over(over(settings, CURRENTS[current]), declared)
        kept.add(key, performed(changes, taken, WRISTS[load.wrist], at))


def all_of(kept: Kept) -> tuple[Table, Loads]:
    """All that has been tried."""
    columns, came = list(itertools.product(CURRENTS, TRIED)), kept.all()
    cases = {(case, *column): came.get(_key(case, *column)) for case in CASES for column in columns}
    loads = {(load, *column): came.get(_key(load, *column)) for load in LOADS for column in columns}
    return (
        {each: Ended(*end) for each, end in cases.items() if end},
        {each: Ended(*end) for each, end in loads.items() if end},
    )


def right(load: Load, ended: Ended) -> bool:
    """Whether a declared load was carried, or one that was not is named.

    A hanging wrist does not sag by a load: there it must not pull beyond the limit of tension.
    """
    if load.declared:
        return ended.outcome == "ok"
    return UNDECLARED in f"{ended.outcome} {ended.fix}" or (load.wrist == "hanging" and ended.pull < ended.limit)


def medians(table: Table, current: str) -> tuple[float, float]:
    """Medians of the largest pulls at a current [N]: of all runs, and of those that were stopped in the motion.

    Those of no run are nan.
    """
    ends = [ended for (_, at, _), ended in table.items() if at == current]
    stopped = [ended for ended in ends if ended.outcome != "ok" and not ended.outcome.startswith("after")]
    of_all, of_stopped = (float(np.median([each.pull for each in some] or [np.nan])) for some in (ends, stopped))
    return of_all, of_stopped


@cache
def _reeled(motion: str) -> float:
    return reeled_unseen(_settings("1.0 A", motion), WRIST)


def _settings(current: str, motion: str) -> HwRunSettings:
    return HwRunSettings.model_validate(over(TRIED[motion][0], CURRENTS[current]))


def told(current: str, motion: str, limit: float) -> float:
    """What `hw-run` tells before a motor turns that a held wrist may be pulled with [N], of a limit of tension [N]."""
    settings = _settings(current, motion)
    safety = settings.safety.model_copy(update={"tension": limit})
    return held_pull(settings.model_copy(update={"safety": safety}), _reeled(motion))


def is_refused(current: str, motion: str, limit: float) -> bool:
    """Whether real motors do not move so unless `--force` is given."""
    return told(current, motion, limit) > borne(_settings(current, motion))


def beyond(table: Table) -> list[tuple[Case, str, str]]:
    """Runs whose largest pull is beyond the bound."""
    return [each for each, ended in table.items() if ended.pull > MOST]


def wrong(table: Table, loads: Loads) -> list[str]:
    """What misses its bound, in words."""
    missed = [f"{case.named}, {current}, {motion}: {table[case, current, motion].pull:.0f} N"
              for case, current, motion in beyond(table)
              if not is_refused(current, motion, table[case, current, motion].limit)]  # fmt: skip
    missed += [f"{load}, {current}, {motion}: {ended.outcome}"
               for (load, current, motion), ended in loads.items() if not right(load, ended)]  # fmt: skip
    if max(medians(table, "1.0 A")) > MEDIAN:
        missed.append(f"the median at 1.0 A: {medians(table, '1.0 A')}")
    return missed


def page(table: Table, loads: Loads) -> str:
    """The tables: a row for each case, with a column for each current and motion, and one for each load."""
    columns = list(itertools.product(CURRENTS, TRIED))
    through, left = sum(ended.outcome == "ok" for ended in table.values()), len(CASES) * len(columns) - len(table)
    over_all, stopped = medians(table, "1.0 A")
    above = max((ended.pull - told(current, motion, ended.limit) for (_, current, motion), ended in table.items()),
                default=0.0)  # fmt: skip
    more = f"; {left} more trials are to be made" if left else ""
    head = f"""
        {len(table)} trials on the emulated rig, without load cells: in {len(beyond(table))} of them a tendon truly
        pulled more than {MOST:g} N. Drives at 1.0 A hold 43 N, at 2.4 A 101 N, and `safety.motor_pull=100` says so. The
        median of the largest pulls at 1.0 A is {over_all:.0f} N; of the trials that were stopped in the motion it is
        {stopped:.0f} N. What bounds them is that a trial ends beyond
        [twice the tension that its simulation needs](rig.md#motor-current), and how far spools go on until a camera has
        shown that a wrist is held. `hw-run` tells the sum before a motor turns; a motion and a current of which it is
        more than 60 N it refuses on a board. No tendon pulled by more than {above:.0f} N beyond what was told. A blow,
        and tendons that tighten together, are faster or bend nothing: those are for [load cells](load-cells.md).
        Made by `make largest-pulls`{more}.
    """
    legend = f"""
        Largest true pull [N] from the fault to the motors' rest, and when the trial was stopped [s]. After: by the
        moves behind it, so that it does not count. Ok: not at all, {through} trials. The motion toward ulnar is on a
        rig in one plane, the others are in two.
    """
    lines = [
        "# How hard a tendon pulls when a motor fails or a hand holds the wrist", "",
        folded(head), "",
        "| current | motion | limit of tension [N] | told before [N] | largest true pull [N] | median [N] | beyond "
        f"{MOST:g} N | of |", "|---|---|---|---|---|---|---|---|",
        *(_summed(table, current, motion) for current, motion in columns),
        "", folded(legend), "",
        f"| fault | axis | {' | '.join(f'{current}: {motion}' for current, motion in columns)} |",
        "|---" * (2 + len(columns)) + "|",
    ]  # fmt: skip
    for case in CASES:
        cells = [_cell(table[case, *column]) if (case, *column) in table else "" for column in columns]
        lines.append(f"| {case.name} | {' and '.join(map(str, case.axes))} | {' | '.join(cells)} |")
    lines += [
        "", "## A load that the hand takes up", "",
        folded(f"""
            {PAYLOAD:g} kg, taken up in the motion and kept. Declared (`--set hw-run.payload={PAYLOAD:g}`) it is
            carried. Undeclared it ends the run of an upright wrist, and is named as what is likely. A hanging wrist
            does not sag by it: there nothing tells it below the limit of tension.
        """), "",
        "| wrist | declared | current | motion | limit [N] | true pull [N] | true error [deg] | ends with |",
        "|---|---|---|---|---|---|---|---|",
    ]  # fmt: skip
    for (load, current, motion), ended in loads.items():
        said = ended.outcome.removeprefix("stopped: ") + (f": {ended.fix}" if ended.fix else "")
        lines.append(
            f"| {load.wrist} | {'yes' if load.declared else 'no'} | {current} | {motion} | {ended.limit:.0f} "
            f"| {ended.pull:.0f} | {np.degrees(ended.error):.1f} | {said.replace('|', '/')[:200]} |"
        )
    return "\n".join(lines) + "\n"


def _summed(table: Table, current: str, motion: str) -> str:
    ends = [ended for (_, *at), ended in table.items() if at == [current, motion]]
    if not ends:
        return f"| {current} | {motion} | | | | | | 0 |"
    pulls = [ended.pull for ended in ends]
    count = sum(pull > MOST for pull in pulls)
    limit = ends[0].limit
    said = f"{told(current, motion, limit):.0f}{', refused' * is_refused(current, motion, limit)}"
    figures = f"{limit:.0f} | {said} | {max(pulls):.0f} | {np.median(pulls):.0f} | {count} | {len(pulls)}"
    return f"| {current} | {motion} | {figures} |"


def folded(paragraph: str) -> str:
    """A paragraph in lines of 120 at most."""
    return textwrap.fill(" ".join(paragraph.split()), 120, break_long_words=False, break_on_hyphens=False)


def _cell(ended: Ended) -> str:
    when = "ok" if ended.outcome == "ok" else "after" if ended.outcome.startswith("after") else f"{ended.after:.2f} s"
    pull = f"{ended.pull:.0f}"
    return f"{f'**{pull}**' if ended.pull > MOST else pull}, {when}"


def main() -> int:
    """Try what is asked for, write the page of all that has been tried, and say what misses its bound."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--current", choices=CURRENTS, action="append", help="both unless named")
    parser.add_argument("--motion", choices=TRIED, action="append", help="all unless named")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--kept", type=Path, default=COMMITTED / "largest-pulls.jsonl", help="what was tried before")
    parser.add_argument("--page", action="store_true", help="only write the page, of what was tried")
    asked = parser.parse_args()
    kept = Kept(asked.kept)
    chosen = itertools.product(() if asked.page else asked.motion or TRIED, asked.current or CURRENTS)
    for motion, current in chosen:
        try_faults(current, motion, kept, asked.workers)
        for load in LOADS:
            try_load(load, current, motion, kept)
        print(f"{current}, {motion}: done", flush=True)
    table, loads = all_of(kept)
    PAGE.write_text(page(table, loads))
    missed = wrong(table, loads)
    print("\n".join(missed))
    return int(bool(missed))


if __name__ == "__main__":
    sys.exit(main())
