"""What the link to the board costs a loop: `python docs/links.py` prints the tables of hardware/real-time.md.

Trials on the emulated rig in virtual time: USB adapters, two periods, and a host that works 3 ms in each tick.
"""

from __future__ import annotations

import contextlib
import io
import sys
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd

from wristctl.cli.app import main as wristctl
from wristctl.trial.control_loop import ControlLoop

SECONDS = 10.0
ADAPTERS = {
    "16U2: a genuine Mega": ["bench.line.adapter=16u2"],
    "CH340: most clones": ["bench.line.adapter=ch340"],
    "FTDI as it comes, 16 ms": ["bench.line.adapter=ftdi"],
}
PERIODS = 5e-3, 10e-3
# Adapter and the seconds for which the host works in each tick.
TRIED = [*((adapter, 0.0) for adapter in ADAPTERS), ("16U2: a genuine Mega", 3e-3)]
ANSWER = ControlLoop._answer


def working(seconds: float) -> None:
    """From here on the host works so long before each answer of a law."""

    def answer(loop: ControlLoop, *given: object) -> object:
        loop._drive.wait_until(loop._drive.now() + seconds)
        return ANSWER(loop, *given)  # type: ignore[arg-type]

    ControlLoop._answer = answer if seconds else ANSWER  # type: ignore[method-assign, assignment]


def tried(settings: list[str]) -> tuple[pd.DataFrame, float]:
    """Ticks of a trial without a push, and its true RMSE [deg]."""
    with tempfile.TemporaryDirectory() as folder:
        given = ["directions=[ulnar]", f"horizon={SECONDS:g}", "push.force=0", "safety.round_trip=3", *settings]
        command = ["hw-run", "--quiet", "--out", folder, *(part for each in given for part in ("--set", each))]
        sys.argv = ["wristctl", *command]
        with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.suppress(SystemExit):
            wristctl()
        data = Path(out.getvalue().split()[-1]) / "data"
        log, trials = pd.read_csv(data / "log.csv"), pd.read_csv(data / "trials.csv")
    return log, float(np.degrees(trials["true_rmse"].iloc[0]))


def main() -> None:
    """Print a row for each adapter, period and work of the host."""
    heads = "USB adapter", "period", "host works", "answer after", "99 of 100 within", "ticks skipped", "true RMSE"
    sys.stdout.write(f"| {' | '.join(heads)} |\n|{'---|' * len(heads)}\n")
    for adapter, work in TRIED:
        working(work)
        for period in PERIODS:
            log, rmse = tried([f"control_period={period:g}", *ADAPTERS[adapter]])
            trips = 1e3 * log["round_trip"].iloc[2:]
            due = round((log["clock"].iloc[-1] - log["clock"].iloc[0]) / period) + 1
            cells = (
                adapter, f"{1e3 * period:g} ms", f"{1e3 * work:g} ms", f"{trips.median():.1f} ms",
                f"{trips.quantile(0.99):.1f} ms", f"{due - len(log)} of {due}", f"{rmse:.3f} deg",
            )  # fmt: skip
            sys.stdout.write(f"| {' | '.join(cells)} |\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main()
