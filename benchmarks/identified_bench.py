"""What `identify` finds on the emulated bench, whose wrist is known: `python benchmarks/identified_bench.py --out DIR`.

For each seed two runs of experiments/identify.yaml, with a hand of 0.3 and of 0.1 kg, the motors' slack drawn anew for
each, and one identification of both. Prints errors and how many 95 % intervals hold the truth; some 150 s a seed.
`--planes 2` has the trials in two planes, and identifies their open logs; some 10 minutes a seed. What a seed gave is
kept in DIR, and another call goes on from there.

Between a count and a tendon the bench has a rotor in its field. The tendon stiffness that is found is that of both
springs in series; the rotor's lag as it turns is the model's own, so that no delay is left.
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
from wristctl.config.study import Study
from wristctl.study_files.load import load_study

STUDY = Path(__file__).resolve().parents[1] / "experiments" / "identify.yaml"
MASSES = (0.3, 0.1)
# Directions of the tendons 1, 2, 4 and 5 [deg].
TOWARD = {1: -135.0, 2: 135.0, 4: -45.0, 5: 45.0}


def run(*arguments: str) -> Path:
    """Directory of the run that a command leaves, or the file that it writes."""
    argv = [sys.executable, "-m", "wristctl", *arguments]
    return Path(subprocess.run(argv, check=True, capture_output=True, text=True).stdout.split()[-1])


def settings(*each: str) -> list[str]:
    """Settings as a command takes them."""
    return [word for setting in each for word in ("--set", setting)]


def trials(seed: int, mass: float, planes: int, out: str) -> Path:
    """A run of hw-run with this hand [kg] and the slack [m] of four tendons that the seed draws."""
    slack = np.random.default_rng([seed, round(10.0 * mass)]).uniform(1e-4, 4e-4, 4)
    drawn = f"hw-run.bench.motors.slack=[{', '.join(f'{each:.2e}' for each in slack)}]"
    own = settings(f"wrist.hand_mass={mass}", f"hw-run.planes={planes}", drawn)
    return run("hw-run", str(STUDY), "--seed", str(seed), "--out", out, "-q", *own)


def identified(study: Study, seed: int, planes: int, out: str) -> pd.DataFrame:
    """What identification finds of a seed's two runs."""
    runs, bench = [trials(seed, mass, planes, out) for mass in MASSES], study.hw_run.bench
    if planes == 1:
        found = run("identify", *map(str, runs), "--out", out, "-q")
    else:
        logs = [str(run("runs", "export", str(each), "--file", f"{each}.csv")) for each in runs]
        motors = bench.motors
        known = settings(
            "model=wrist", f"exposure={bench.camera.exposure}", f"holding_torque={motors.holding_torque}",
            f"rotor_inertia={motors.rotor_inertia + motors.spool_inertia}", f"rotor_damping={motors.damping}",
        )  # fmt: skip
        found = run("identify", *logs, *known, "--out", out, "-q")
    return pd.read_csv(found / "data" / "parameters.csv").assign(seed=seed)


def kept(study: Study, seed: int, planes: int, out: str) -> pd.DataFrame:
    """What identification finds of a seed's two runs, now or in an earlier call."""
    file = Path(out) / f"planes-{planes}-seed-{seed}.csv"
    if not file.is_file():
        identified(study, seed, planes, out).to_csv(file, index=False)
    return pd.read_csv(file)


def truth(study: Study, planes: int) -> dict[str, float]:
    """What the bench really has, by `identify`'s names; SI units, directions in degrees."""
    wrist, bench = study.wrist, study.hw_run.bench
    motor = stepper_of(bench)
    stiffness, field = wrist.stiffness * bench.plant.stiffness_scale, 2.0 * math.pi / motor.turn * motor.holding
    of_all = {
        "damping": wrist.damping, "tendon_stiffness": 1.0 / (1.0 / bench.actuator.tendon_stiffness + 1.0 / field),
        "friction": bench.actuator.friction, "presliding": bench.actuator.presliding, "delay": 0.0,
    }  # fmt: skip
    if planes == 1:
        others = {"flexion_ratio": wrist.flexion_ratio, "tendon_radius": wrist.tendon_radius}
        return {"stiffness": stiffness} | of_all | others
    places = {f"direction_{number}": angle for number, angle in TOWARD.items()} | {f"gain_{n}": 1.0 for n in TOWARD}
    return {"stiffness": stiffness, "stiffness_across": stiffness * wrist.flexion_ratio} | of_all | places


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", required=True, help="directory of the runs")
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--planes", type=int, choices=(1, 2), default=1)
    options = parser.parse_args()
    study = load_study([STUDY])
    table = pd.concat(kept(study, seed, options.planes, options.out) for seed in range(1, options.seeds + 1))
    print("\n".join(lines(table, truth(study, options.planes))))


def lines(table: pd.DataFrame, true: dict[str, float]) -> list[str]:
    """A line for each parameter: its truth, half the interval, how many hold the truth, and the errors by seed."""
    printed = [f"{'':17} {'truth':>8} {'half the interval':>18} {'hold the truth':>15}  errors by seed"]
    for name, wanted in true.items():
        own = table[table.parameter == name]
        scale, unit = (1e3, "ms") if name == "delay" else (100.0 / wanted, "%")
        if name.startswith("direction"):
            scale, unit = 1.0, "deg"
        half = scale * float((own.high - own.low).mean()) / 2.0
        held = int(((own.low <= wanted) & (wanted <= own.high)).sum())
        errors = " ".join(f"{scale * (value - wanted):+.2f}" for value in own.value)
        printed.append(f"{name:17} {wanted:8.4g} {half:15.2f} {unit:2} {held:8} of {len(own):3}  {errors} {unit}")
    return printed


if __name__ == "__main__":
    main()
