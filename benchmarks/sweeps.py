"""A sweep over any leaf beside one batch of as many gains: `python benchmarks/sweeps.py`. Prints PASS or FAIL.

Processor time, so that a busy machine changes little; the best of three.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial

import numpy as np

from wristctl.config.load import load_study
from wristctl.config.study import Study
from wristctl.config.sweeps import axes_of, points_of
from wristctl.control.table import controller, gains_of
from wristctl.simulation.batch import sample_period
from wristctl.simulation.cases import Case, measure
from wristctl.simulation.reference import motion
from wristctl.simulation.swept_loops import swept_metrics
from wristctl.studies.sweep_unit import simulated, sweep_units

POINTS, TRIES, MOST = 1000, 3, 1.5
BASE = ("simulate.controller=pid-ff", "simulate.gains={Kp: 4.0, Ki: 20.0, Kd: 0.2}")
LEAVES = {
    "wrist": ("wrist.stiffness=0.5..0.8", ()),
    "gains": ("simulate.gains.Kp=1..8", ()),
    "reference": ("simulate.reference.angle_deg=5..40", ()),
    "actuator": ("simulate.loop.actuator.lag=0.002..0.01", ("simulate.loop.actuator.level=lagged",)),
    "sensor": (
        "simulate.loop.sensor.noise_deg=0.02..0.1",
        ("simulate.loop.sensor.level=camera", "simulate.loop.control_period=5e-3"),
    ),
}


def least(work: Callable[[], object]) -> float:
    """Processor seconds, the best of a few after one that compiles."""
    work()
    times = []
    for _ in range(TRIES):
        begun = time.process_time()
        work()
        times.append(time.process_time() - begun)
    return min(times)


def batch(study: Study) -> float:
    """Of one batch of gains on the loop of the study, with the metrics of a sweep."""
    chosen, law = study.simulate, controller(study.simulate.controller)
    followed = motion(chosen.reference, study.wrist, chosen.horizon, sample_period(chosen.loop.control_period))
    gains = np.array(gains_of(law, chosen.gains)) * np.linspace(0.5, 1.5, POINTS)[:, None]
    case = Case(chosen.loop, followed, (0,), 0)
    return least(lambda: measure(law, gains, [case], study.wrist, swept_metrics()))


def main() -> None:
    """Measure each kind of leaf."""
    for kind, (sweep, others) in LEAVES.items():
        study = load_study(overrides=[*BASE, *others])
        known = batch(study)
        axes = axes_of(study.model_copy(update={"sweep": (f"{sweep}:{POINTS}",)}), "simulate")
        (unit,) = sweep_units(study, "simulate", axes, points_of(axes))
        ratio = least(partial(simulated, unit.spec)) / known
        verdict = "PASS" if ratio <= MOST else "FAIL"
        print(f"{verdict} {kind}: {sweep}:{POINTS} takes {ratio:.2f} times a batch of {POINTS} gains ({known:.2f} s)")


if __name__ == "__main__":
    main()
