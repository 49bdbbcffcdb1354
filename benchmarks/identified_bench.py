"""What `identify` finds on the emulated bench, whose wrist is known: `python benchmarks/identified_bench.py --out DIR`.

For each seed two runs of experiments/identify.yaml, with a hand of 0.3 and of 0.1 kg, the motors' slack drawn anew for
each, and one identification of both. Prints errors and how many 95 % intervals hold the truth; some 45 s a seed.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd

from wristctl.study_files.load import load_study

STUDY = Path(__file__).resolve().parents[1] / "experiments" / "identify.yaml"
MASSES = (0.3, 0.1)


def run(*arguments: str) -> Path:
    """Directory of the run that a command leaves."""
    argv = [sys.executable, "-m", "wristctl", *arguments, "-q"]
    return Path(subprocess.run(argv, check=True, capture_output=True, text=True).stdout.split()[-1])


def trials(seed: int, mass: float, out: str) -> str:
    """A run of hw-run with this hand [kg] and the slack [m] of four tendons that the seed draws."""
    slack = np.random.default_rng([seed, round(10.0 * mass)]).uniform(1e-4, 4e-4, 4)
    settings = (f"wrist.hand_mass={mass}", f"hw-run.bench.motors.slack=[{', '.join(f'{each:.2e}' for each in slack)}]")
    options = [word for each in settings for word in ("--set", each)]
    return str(run("hw-run", str(STUDY), "--seed", str(seed), "--out", out, *options))


def truth() -> dict[str, float]:
    """What the bench really has, by `identify`'s names; SI units."""
    study = load_study([STUDY])
    wrist, bench = study.wrist, study.hw_run.bench
    return {
        "stiffness": wrist.stiffness * bench.plant.stiffness_scale, "damping": wrist.damping,
        "tendon_stiffness": bench.actuator.tendon_stiffness, "friction": bench.actuator.friction, "delay": 0.0,
        "tendon_radius": wrist.tendon_radius,
    }  # fmt: skip


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", required=True, help="directory of the runs")
    parser.add_argument("--seeds", type=int, default=8)
    options = parser.parse_args()
    tables = []
    for seed in range(1, options.seeds + 1):
        found = run("identify", *(trials(seed, mass, options.out) for mass in MASSES), "--out", options.out)
        tables.append(pd.read_csv(found / "data" / "parameters.csv").assign(seed=seed))
    table = pd.concat(tables)
    print(f"{'':17} {'truth':>8} {'half the interval':>18} {'hold the truth':>15}  errors, seed 1 to {options.seeds}")
    for name, wanted in truth().items():
        own = table[table.parameter == name]
        scale, unit = (100.0 / wanted, "%") if wanted else (1e3, "ms")
        half = scale * float((own.high - own.low).mean()) / 2.0
        held = int(((own.low <= wanted) & (wanted <= own.high)).sum())
        errors = " ".join(f"{scale * (value - wanted):+.2f}" for value in own.value)
        print(f"{name:17} {wanted:8.4g} {half:15.2f} {unit:2} {held:8} of {len(own):3}  {errors} {unit}")


if __name__ == "__main__":
    main()
