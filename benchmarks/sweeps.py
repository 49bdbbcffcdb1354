"""A sweep over any leaf beside one batch of as many gains: `python benchmarks/sweeps.py`. Prints PASS or FAIL.

By the wall, and of all processors together: medians of five pairs, one right after the other.
"""

from __future__ import annotations

import gc
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from wristctl.commands.sweep.command import simulated, sweep_units
from wristctl.config.loop import sample_period
from wristctl.config.study import Study
from wristctl.control.table import controller, gains_of
from wristctl.simulation.cases import Case, measure
from wristctl.simulation.reference import motion
from wristctl.simulation.swept_loops import swept_metrics
from wristctl.study_files.load import load_study
from wristctl.study_files.sweeps import axes_of, points_of

POINTS, PAIRS, MOST = 1000, 5, 1.5
FOLDER = tempfile.TemporaryDirectory()
WALK = Path(FOLDER.name) / "walk.csv"
BASE = ("simulate.controller=pid-ff", "simulate.gains={Kp: 4.0, Ki: 20.0, Kd: 0.2}")
TENDON = ("simulate.loop.actuator.level=tendon", "simulate.loop.actuator.sheath=1.0")
CAMERA = ("simulate.loop.sensor.level=camera", "simulate.loop.control_period=5e-3")
LEAVES = {
    "wrist": (
        (),
        ("wrist.stiffness=0.5..0.8", "wrist.damping=0.05..0.2", "wrist.length=0.05..0.12", "wrist.mass=0.02..0.1",
         "wrist.hand_mass=0..0.5", "wrist.hand_offset=0.03..0.09", "wrist.tendon_radius=0.01..0.025",
         "wrist.pretension=0..5", "wrist.tension_limit=20..100", "wrist.flexion_ratio=0.7..1.3",
         "wrist.range_deg=45..80", "wrist.gravity.0=-9.81..9.81"),
    ),
    "gains": ((), ("simulate.gains.Kp=1..8", "simulate.gains.Ki=5..40", "simulate.gains.Kd=0.1..0.4")),
    "reference": ((), ("simulate.reference.angle_deg=5..40", "simulate.reference.duration=0.5..1.5")),
    "sine": (("simulate.reference.kind=sine",), ("simulate.reference.frequency=0.3..1",)),
    "two-sided sine": (
        ("simulate.reference.kind=two-sided-sine",),
        ("simulate.reference.phase_deg=0..90", "simulate.reference.offset_deg=0..5"),
    ),
    "chirp": (("simulate.reference.kind=chirp",), ("simulate.reference.end_frequency=2..4",)),
    "square": (("simulate.reference.kind=square",), ("simulate.reference.offset_deg=0..5",)),
    "random steps": (("simulate.reference.kind=random-steps",), ("simulate.reference.duration=0.2..1",)),
    "daily living": (("simulate.reference.kind=adl:jar",), ("simulate.reference.scale=0.5..1",)),
    "recording": (
        ("simulate.reference.kind=recording", f"simulate.reference.file={WALK}"), ("simulate.reference.scale=0.5..1.5",)
    ),
    "angles": (
        ("simulate.reference.kind=multi-step", "simulate.reference.angles_deg=[10.0, -5.0]"),
        ("simulate.reference.angles_deg.0=5..20",),
    ),
    "tip": (
        ("simulate.reference.tip=[0.075, 0.02]", "simulate.reference.inverse=closed-form"),
        ("simulate.reference.tip.0=0.07..0.08",),
    ),
    "tip path": (
        ("simulate.reference.kind=tip-path", "simulate.reference.inverse=closed-form"),
        ("simulate.reference.tips.0.0=0.07..0.08",),
    ),
    "lagged actuator": (("simulate.loop.actuator.level=lagged",), ("simulate.loop.actuator.lag=0.002..0.01",)),
    "actuator": (
        TENDON,
        tuple(f"simulate.loop.actuator.{each}" for each in (
            "tendon_stiffness=8e3..4e4", "friction=0.03..0.2", "sheath=0.5..3", "presliding=1e-5..1e-4",
            "pulley_radius=0.005..0.01", "step_rate=5e3..2e4", "step_acceleration=2e4..1e5")),
    ),
    "sensor": (
        CAMERA,
        tuple(f"simulate.loop.sensor.{each}" for each in (
            "noise_deg=0.02..0.1", "delay_frames=1..3", "frame_rate=30..120", "dropped=0..0.2",
            "torque_noise=1e-4..1e-3", "load_drift=0.01..0.1")),
    ),
}  # fmt: skip


def took(work: Callable[[], object]) -> tuple[float, float]:
    """Seconds by the wall and of processors."""
    begun = time.perf_counter(), time.process_time()
    work()
    return time.perf_counter() - begun[0], time.process_time() - begun[1]


def batch(study: Study) -> Callable[[], object]:
    """One batch of gains on the loop of the study, with the metrics of a sweep."""
    chosen, law = study.simulate, controller(study.simulate.controller)
    followed = motion(chosen.reference, study.wrist, chosen.horizon, sample_period(chosen.loop.control_period))
    gains = np.array(gains_of(law, chosen.gains)) * np.linspace(0.5, 1.5, POINTS)[:, None]
    case = Case(chosen.loop, followed, (0,), 0)
    return partial(measure, law, gains, [case], study.wrist, swept_metrics())


def swept(study: Study, sweep: str) -> Callable[[], object]:
    """All points of a sweep, none of which a cache knows from another."""
    axes = axes_of(study.model_copy(update={"sweep": (sweep,)}), "simulate")
    units = sweep_units(study, "simulate", axes, points_of(axes))
    return lambda: [simulated(unit.spec) for unit in units]


def main() -> None:
    """Measure each kind of leaf."""
    gc.set_threshold(100_000, 50, 100)  # as the command line has it
    time_s = np.arange(0.0, 5.0, 0.01)
    motion_of_it = np.column_stack([time_s, 10.0 * np.sin(time_s)])
    np.savetxt(WALK, motion_of_it, delimiter=",", header="time [s],angle [deg]", comments="")
    for kind, (others, sweeps) in LEAVES.items():
        study = load_study(overrides=[*BASE, *others])
        known = batch(study)
        known()  # compiled
        for sweep in sweeps:
            first, *others_of_it = [swept(study, f"{sweep}:{POINTS + k}") for k in range(PAIRS + 1)]
            first()
            times = np.array([(took(each), took(known)) for each in others_of_it])
            ratio, busy = np.median(times[:, 0] / times[:, 1], axis=0)
            alone, verdict = np.median(times[:, 1, 0]), "PASS" if ratio <= MOST else "FAIL"
            says = f"takes {ratio:.2f} times a batch of {POINTS} gains ({alone:.2f} s; of processors {busy:.2f})"
            print(f"{verdict} {kind}: {sweep}:{POINTS} {says}", flush=True)


if __name__ == "__main__":
    main()
