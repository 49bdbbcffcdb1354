"""Made-up measured loops: of a wrist that is not quite as believed, with noise of camera and load cells."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from wristctl.config.hysteresis import HysteresisSettings
from wristctl.config.identify import IdentifySettings
from wristctl.config.plant import Actuator
from wristctl.config.wrist import WristParameters
from wristctl.identification.loop_problem import LoopProblem
from wristctl.identification.measured_loop import MeasuredLoop
from wristctl.simulation.spool_driven import SpooledWrist, spooled
from wristctl.simulation.strokes import FrictionCase, strokes

BELIEVED, ASKED = WristParameters(), IdentifySettings()
KNOWN = ASKED.known
Measured = Literal["spools and tensions", "spools", "tensions"]
_STEP = 5e-4
"""Half of what a fit takes by default [s]: nature has no steps."""


class Recording(NamedTuple):
    """How a loop is driven and recorded; it begins somewhere on the way, at `lead` of a cycle."""

    low: float = 0.0
    high: float = 30.0
    frequency: float = 0.1
    cycles: float = 2.0
    lead: float = 0.75
    rate: float = 60.0
    noise_deg: float = 0.05
    noise: float = 0.05
    what: Measured = "spools and tensions"
    errors: tuple[float, ...] | None = None
    """Of stiffness, damping, tendons, zeros of the angle and of both spools, over what is known; None: drawn."""


SHORT = Recording(frequency=0.3, cycles=1.6, lead=0.8)
"""Little to compute."""


def made_loop(truth: FrictionCase, seed: int, recording: Recording | None = None) -> LoopProblem:
    """A measured loop of tendons with such friction; springs, damping, tendons and zeros differ as is known of them."""
    recording, rng = recording or Recording(), np.random.default_rng(seed)
    winch = recording.what == "tensions"
    settings = HysteresisSettings(
        ranges_deg=((recording.low, recording.high),), angles_deg=(), drive="tensions" if winch else "spools",
    )  # fmt: skip
    own, drawn = strokes(BELIEVED, settings), rng.standard_normal(6)
    drawn = drawn if recording.errors is None else np.array(recording.errors)
    wrist = BELIEVED.model_copy(
        update={
            "stiffness": BELIEVED.stiffness * math.exp(KNOWN.stiffness_error * drawn[0]),
            "damping": BELIEVED.damping * math.exp(KNOWN.damping_error * drawn[1]),
        }
    )
    stiffness = settings.tendon_stiffness * math.exp(KNOWN.tendon_stiffness_error * drawn[2])
    tendons = Actuator(level="tendon", tendon_stiffness=stiffness, **truth._asdict())
    zeros = np.zeros(2) if winch else ASKED.spool_error * drawn[4:]

    def given(time: np.ndarray) -> np.ndarray:
        swing = 0.5 - 0.5 * np.cos(2.0 * np.pi * recording.frequency * time)
        return own.given(np.radians(recording.low + (recording.high - recording.low) * swing))

    steps = math.ceil((recording.lead + recording.cycles) / (recording.frequency * _STEP)) + 1
    lane = SpooledWrist(wrist, tendons, own.theta_at(np.array(np.radians(recording.low))), winch)
    done = spooled([lane], lambda time, which: (given(time) + zeros[:, None]).T[:, :, None], steps, _STEP)
    time = np.arange(0.0, recording.cycles / recording.frequency, 1.0 / recording.rate)
    at = time + recording.lead / recording.frequency
    grid = _STEP * np.arange(done.theta.shape[1])
    angle, *pulls = (np.interp(at, grid, each[0]) for each in (done.theta, done.spool[..., 0], done.spool[..., 1]))
    angle += math.radians(ASKED.zero_error_deg * drawn[3]) + np.radians(recording.noise_deg) * rng.standard_normal(
        len(at)
    )
    tensions = 0.5 * np.stack(pulls, axis=1)
    seen = tensions + recording.noise * rng.standard_normal(tensions.shape)
    loop = {
        "spools and tensions": (given(at).T, seen),
        "spools": (given(at).T, None),
        "tensions": (None, 0.5 * given(at).T),
    }[recording.what]
    asked = ASKED.model_copy(update={"known": KNOWN.model_copy(update={"run_up": 10.0 * truth.presliding})})
    return LoopProblem(MeasuredLoop("made.csv", time, angle, *loop), BELIEVED, asked)


def written(loop: MeasuredLoop, file: Path) -> Path:
    """The loop as a CSV file that somebody may have exported."""
    columns = {"time [s]": loop.time, "angle [deg]": np.degrees(loop.angle)}
    if loop.spools is not None:
        columns |= {"spool_plus [mm]": 1e3 * loop.spools[:, 0], "spool_minus [mm]": 1e3 * loop.spools[:, 1]}
    if loop.tensions is not None:
        columns |= {"tension_plus [N]": loop.tensions[:, 0], "tension_minus [N]": loop.tensions[:, 1]}
    rows = np.stack(list(columns.values()), axis=1)
    lines = [",".join(columns), *(",".join(f"{value:.9g}" for value in row) for row in rows)]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return file
