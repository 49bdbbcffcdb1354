"""What `identify` finds on the emulated bench, whose wrist is known: `python benchmarks/identified_bench.py --out DIR`.

For each seed two runs of experiments/identify.yaml, with a hand of 0.3 and of 0.1 kg, the motors' slack drawn anew for
each, and one identification of both. Prints errors and how many 95 % intervals hold the truth; some 75 s a seed.

A model of what hangs on spools sees the magnetic field of the bench's motors too: a rotor gives way to its tendon's
pull, and lags behind its field as it turns. True tendon stiffness is that of both in series at the trials' mean pull,
and the true delay has the rotor's lag.
"""

from __future__ import annotations

import argparse
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd

from wristctl.bench.motors import stepper_of
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


def truth(mean_pull: float) -> dict[str, float]:
    """What the bench really has, by `identify`'s names; SI units. `mean_pull` is that of a tendon in the trials [N]."""
    study = load_study([STUDY])
    wrist, bench = study.wrist, study.hw_run.bench
    motor = stepper_of(bench)
    field = 2.0 * math.pi / motor.turn * math.sqrt(motor.holding**2 - mean_pull**2)
    return {
        "stiffness": wrist.stiffness * bench.plant.stiffness_scale, "flexion_ratio": wrist.flexion_ratio,
        "damping": wrist.damping, "tendon_stiffness": 1.0 / (1.0 / bench.actuator.tendon_stiffness + 1.0 / field),
        "friction": bench.actuator.friction, "delay": motor.damping / field, "tendon_radius": wrist.tendon_radius,
    }  # fmt: skip


def pull_of(runs: list[str]) -> float:
    """Mean pull of a tendon in the trials of runs [N]."""
    truths = [pd.read_csv(Path(path) / "data" / "truth.csv") for path in runs]
    return float(np.mean([table.filter(regex="^pull_").to_numpy().mean() for table in truths]))


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", required=True, help="directory of the runs")
    parser.add_argument("--seeds", type=int, default=8)
    options = parser.parse_args()
    tables, pulls = [], []
    for seed in range(1, options.seeds + 1):
        runs = [trials(seed, mass, options.out) for mass in MASSES]
        found = run("identify", *runs, "--out", options.out)
        pulls.append(pull_of(runs))
        tables.append(pd.read_csv(found / "data" / "parameters.csv").assign(seed=seed))
    table = pd.concat(tables)
    print(f"{'':17} {'truth':>8} {'half the interval':>18} {'hold the truth':>15}  errors, seed 1 to {options.seeds}")
    for name, wanted in truth(float(np.mean(pulls))).items():
        own = table[table.parameter == name]
        scale, unit = (1e3, "ms") if name == "delay" else (100.0 / wanted, "%")
        half = scale * float((own.high - own.low).mean()) / 2.0
        held = int(((own.low <= wanted) & (wanted <= own.high)).sum())
        errors = " ".join(f"{scale * (value - wanted):+.2f}" for value in own.value)
        print(f"{name:17} {wanted:8.4g} {half:15.2f} {unit:2} {held:8} of {len(own):3}  {errors} {unit}")


if __name__ == "__main__":
    main()
