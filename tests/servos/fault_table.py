"""Each fault of each emulated servo, and trials without one, as a table: `make servo-faults`, docs/servos.md.

What has been tried is kept in build/servo-faults, and a later run goes on from there.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Iterator
from pathlib import Path

from tests.servos.fault_trials import SURVIVED, Came, tried
from wristctl.servos.emulated import FAULTS

SOUND = tuple(("", 0, tendons, motion) for tendons in (3, 4) for motion in ("dart-thrower", "circumduction"))


def cases() -> Iterator[tuple[str, int, int, str]]:
    """Fault, servo, number of tendons and motion of each trial."""
    yield from SOUND
    for fault in FAULTS:
        yield fault, 2, 3, "circumduction"
    for fault in FAULTS:
        yield fault, 4, 4, "dart-thrower"


def kept(folder: Path, case: tuple[str, int, int, str]) -> Came:
    """A trial, by its file where it has been tried."""
    fault, servo, tendons, motion = case
    file = folder / f"{fault or 'none'}-{servo}-{tendons}-{motion}.json"
    if not file.is_file():
        file.write_text(json.dumps(tried(fault, servo, tendons, motion)._asdict()))
    return Came(**json.loads(file.read_text()))


def row(name: str, came: list[Came]) -> str:
    """A row of the table: trials of one kind."""
    fine = sum(one.outcome == "ok" for one in came)
    within = [one.named_within for one in came if math.isfinite(one.named_within)]
    largest = max(one.largest_pull for one in came)
    slowest = f"{1e3 * max(within):.0f} ms" if within else "homing" if largest > 0.0 else "connecting"
    pull, words = f"{largest:.1f}", came[0].outcome
    for begin in ("before it: ", "stopped: ", "the rig has stopped by itself: ", "the rig does not answer: "):
        words = words.removeprefix(begin)
    words = words.split(";")[0]
    if came[0].fault in SURVIVED:
        worst = max(one.error_deg for one in came)
        words, slowest = f"followed, {worst:.2f} deg off at most, {sum(one.lost for one in came)} answers lost", ""
    return f"| {name} | {fine} of {len(came)} | {slowest} | {pull} | {words} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kept", type=Path, default=Path("build/servo-faults"))
    folder = parser.parse_args().kept
    folder.mkdir(parents=True, exist_ok=True)
    came = [kept(folder, case) for case in cases()]
    print(
        "| fault | trials called ok | stopped within | largest true tension [N] | what is said |\n|---|---|---|---|---|"
    )
    print(row("none", [one for one in came if not one.fault]))
    for fault, words in FAULTS.items():
        print(row(words, [one for one in came if one.fault == fault]))
    limit = came[0].limit
    false = sum(one.outcome == "ok" and one.fault not in SURVIVED for one in came)
    largest = max(one.largest_pull for one in came)
    slack = max(one.slack_error for one in came if math.isfinite(one.slack_error))
    print(f"\n{len(came)} trials, {false} called ok with a fault; largest true tension {largest:.1f} N of {limit:g} N;")
    print(f"homing errs about slack by {1e3 * slack:.3f} mm at most.")


if __name__ == "__main__":
    main()
