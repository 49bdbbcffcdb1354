"""Rigs and gains drawn at random: does a trial's simulation swing at rest where the trial does?

`python -m tests.trial.twins` goes on until ten of each kind have been seen, by the true angle of the emulated wrist:
springs, tendons, friction, motors, camera and person are drawn as in sound_rigs.py, laws and gains beside. What a limit
stops, or a homing refuses, is no trial. Writes docs/hardware/twins.md; exit code 1 where fewer than 18 of 20 agree.
"""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import wristctl
from tests.commands.conftest import session
from tests.drawn_rigs import options, tried
from tests.trial.fault_runs import rig_settings
from wristctl.commands.hw_run.answer import swings_of
from wristctl.commands.hw_run.command import hw_run
from wristctl.commands.hw_run.trial_means import completed
from wristctl.control.table import controller
from wristctl.errors import UserError
from wristctl.records import start_run
from wristctl.simulation.oscillation import LIMIT_CYCLE

SEED = 20261129
PAGE = Path(__file__).parents[2] / "docs" / "hardware" / "twins.md"
LAWS = "pd-ff", "pid-ff", "pid-dob", "ct-dob", "super-twisting", "impedance"
EACH = 10
"""Trials that swing, and trials that rest."""


def settings_of(number: int) -> dict[str, Any]:
    """Settings of hw-run: a drawn rig, and a law whose feedback gains are hardware's times a drawn factor."""
    rng = np.random.default_rng([SEED, number])
    rig = rig_settings(rng, number)
    law = controller(LAWS[number % len(LAWS)])
    factor = float(np.exp(rng.uniform(np.log(0.8), np.log(6.0))))
    gains = {name: value * (1.0 if name in _NO_SIZE else factor) for name, value in law.presets["hardware"].items()}
    rig.pop("rows")
    return rig | {
        "controllers": [{"controller": law.name, "gains": gains}], "push": {"force": 0.0}, "without_push": True,
        "horizon": 5.0, "reference": {"angle_deg": float(rng.uniform(10.0, 30.0))},
    }  # fmt: skip


# Gains that say how a law damps or what part of it is a network's, and not how strong it is.
_NO_SIZE = ("zeta", "phi", "beta")


def ended_on(number: int) -> dict[str, Any]:
    """What a trial came to: swings peak to peak [deg], or why there is none."""
    settings = settings_of(number)
    row = settings["controllers"][0]
    study = wristctl.load_study(None, f"hw-run={json.dumps(settings)}", f"seed={number}")
    drawn = {"controller": row["controller"], "gains": row["gains"], "angle_deg": settings["reference"]["angle_deg"]}
    try:
        with start_run("hw-run", study, "", Path(tempfile.mkdtemp())) as live:
            done = hw_run(session(study, live))
    except UserError as stop:
        return drawn | {"stopped": stop.what}
    swings = swings_of(completed(done.trials), done.twins)
    seen, true, simulated = (float(np.degrees(each[0])) for each in swings)
    return drawn | {
        "seen": seen, "true": true, "simulated": simulated,
        "swings": bool(swings.known[0] > 2.0 * LIMIT_CYCLE), "twin": bool(swings.simulated[0] > 2.0 * LIMIT_CYCLE),
    }  # fmt: skip


def page(rows: list[dict[str, Any]], stopped: int) -> str:
    """The table: a row for each trial."""
    agreed = sum(row["swings"] == row["twin"] for row in rows)
    lines = [
        "# Does the simulation beside a trial swing where the rig does?", "",
        f"{len(rows)} trials on drawn rigs with drawn gains, half of which swing at rest by more than 0.2 deg peak to",
        f"peak: in {agreed} the simulation of the trial says the same as the emulated wrist's true angle. {stopped}",
        "more were stopped before their end by a limit or in homing. Made by `make twins`.", "",
        "| controller | gains | move [deg] | true swing [deg] | by camera [deg] | simulated [deg] | agree |",
        "|---|---|---|---|---|---|---|",
    ]  # fmt: skip
    for row in rows:
        gains = ", ".join(f"{name} {value:.3g}" for name, value in row["gains"].items())
        figures = " | ".join(f"{row[name]:.2g}" for name in ("true", "seen", "simulated"))
        agree = "yes" if row["swings"] == row["twin"] else "**no**"
        lines.append(f"| {row['controller']} | {gains} | {row['angle_deg']:.0f} | {figures} | {agree} |")
    return "\n".join(lines) + "\n"


def main() -> int:
    """Try rigs until there are enough of both kinds, and write the page."""
    asked = options(__doc__, 200, "twins").parse_args()
    kinds: dict[bool, list[dict[str, Any]]] = {True: [], False: []}
    stopped = 0
    for number, row in tried(asked, ended_on):
        print(number, json.dumps(row), flush=True)
        if "stopped" in row:
            stopped += 1
        elif len(kinds[row["swings"]]) < EACH:
            kinds[row["swings"]].append(row)
        if all(len(rows) == EACH for rows in kinds.values()):
            break
    rows = [*kinds[True], *kinds[False]]
    text = page(rows, stopped)
    print(text)
    if len(rows) == 2 * EACH:
        PAGE.write_text(text)
    return int(sum(row["swings"] == row["twin"] for row in rows) < 0.9 * len(rows))


if __name__ == "__main__":
    sys.exit(main())
