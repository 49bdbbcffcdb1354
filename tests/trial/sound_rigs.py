"""Sound rigs drawn at random, each homed and tried once: which are stopped all the same, and by what.

Wrist, controller with its gains, motion, springs, pulleys, tendons, sheaths, friction, creep, the cameras' poses,
lenses, light and latency, the USB adapter and a declared load of the hand are drawn: `python -m
tests.trial.sound_rigs` keeps what has ended, goes on where it was, and writes docs/hardware/sound-rigs.md. Exit code:
how many were stopped.
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tests.drawn_rigs import options, tried
from tests.trial.conftest import WRIST
from tests.trial.fault_runs import camera_before, injecting, over, rig_settings
from tests.trial.largest_pulls import folded
from tests.trial.single_trials import Ended, performed
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller
from wristctl.trial.resting import sag_of
from wristctl.tuning.scaled_presets import scaled_to

SEED = 20261123
RIGS = 100
PAGE = Path(__file__).parents[2] / "docs" / "hardware" / "sound-rigs.md"
LAWS = "smc-tracking", "ct-dob", "pid-ff", "pid-dob", "adrc", "lqi", "mpc", "impedance", "mrac"
TAKEN = 0.3
"""When the hand takes up its load: seconds after the motion began."""
# Gains that say how a controller damps or what part of it is a network's, and not how strong it is.
_NO_SIZE = ("zeta", "phi", "beta")


class Rig(NamedTuple):
    """A drawn rig."""

    wrist: WristParameters
    settings: dict[str, Any]


def drawn(number: int) -> Rig:
    """The rig of this number.

    Every fifth bends in two planes, every second wrist is another one, and every fourth hand takes up a load.
    """
    rng = np.random.default_rng([SEED, number])
    settings = rig_settings(rng, number)
    wrist = WRIST if number % 2 == 0 else _wrist(rng, settings["bench"]["plant"]["stiffness_scale"])
    law = scaled_to(wrist, controller(LAWS[number % len(LAWS)]))
    factor = float(np.exp(rng.uniform(np.log(0.7), np.log(1.2))))
    gains = {name: value * (1.0 if name in _NO_SIZE else factor) for name, value in law.presets["hardware"].items()}
    settings.pop("rows")
    push = {"force": 2.0 * WRIST.length / wrist.length, "start": 2.0}
    settings = over(settings, {"controllers": ({"controller": law.name, "gains": gains},), "push": push})
    settings = over(settings, _in_two_planes(rng, number) if number % 5 == 2 else _in_one_plane(rng))
    if number // 2 % 4 == 1:
        settings["payload"] = float(rng.uniform(0.05, 0.5))
    return Rig(wrist, settings)


def _wrist(rng: np.random.Generator, weakened: float) -> WristParameters:
    """Another wrist, upright, that does not buckle with its springs weakened so."""
    while True:
        stiffness = math.exp(rng.uniform(math.log(0.2), math.log(3.0)))
        length, hand = float(rng.uniform(0.06, 0.14)), float(rng.uniform(0.0, 0.5))
        wrist = WristParameters(length=length, stiffness=stiffness, hand_mass=hand)
        if math.isfinite(sag_of(wrist.model_copy(update={"stiffness": weakened * stiffness}), "ulnar")):
            return wrist


def _in_one_plane(rng: np.random.Generator) -> dict[str, Any]:
    angle, duration = float(rng.uniform(10.0, 30.0)), float(rng.uniform(0.8, 1.5))
    return {"reference": {"angle_deg": angle, "duration": duration}}


def _in_two_planes(rng: np.random.Generator, number: int) -> dict[str, Any]:
    angle, slower = float(rng.uniform(10.0, 25.0)), float(rng.uniform(1.0, 1.5))
    late = rng.uniform(-0.02, 0.02)
    second = {"camera_2": {"delay_frames": 2.0 + 60.0 * late, "phase": 0.4, "scene": camera_before(rng)}}
    motion: dict[str, Any] = (
        {"reference": {"kind": "circumduction", "angle_deg": angle, "turn": 4.0 * slower}},
        {"reference": {"kind": "dart-thrower", "angle_deg": angle, "turn": 1.5 * slower}},
        {"reference": {"angle_deg": angle, "duration": slower}, "directions": ("radial-extension",)},
    )[number // 5 % 3]
    return {"planes": 2, "bench": second, **motion}


def ended_on(number: int) -> Ended:
    """How the trial of this rig ended."""
    wrist, settings = drawn(number)
    taken = {"kind": "payload-taken", "size": settings.get("payload", 0.0), "at": TAKEN, "since": "first trial"}
    return performed(settings, injecting([taken] if "payload" in settings else []), wrist, seed=number)


def page(ends: dict[int, Ended]) -> str:
    """The table: a row for each rig."""
    stopped, left = sum(ended.outcome != "ok" for ended in ends.values()), RIGS - len(ends)
    told = f"""
        {len(ends)} sound rigs were drawn, homed and tried once; stopped: {stopped}. Drawn are springs of 0.6 to 1.2
        of what is believed, tendons of 5 to 50 kN/m (believed: 20), pulleys, sheaths of 0 to 2 rad, friction, creep,
        poses and lenses of cameras, light, latency and USB adapter. Every second wrist has another length, stiffness
        and hand, and gains scaled to it; gains are 0.7 to 1.2 of the preset `hardware`; every fourth hand takes up a
        load that was declared; every fifth rig bends in two planes. A person pushes against the bend. Made by
        `make sound-rigs`{f"; {left} more are to be tried" if left > 0 else ""}.
    """
    lines = [
        "# Sound rigs that are stopped all the same", "",
        folded(told), "",
        "| rig | planes | wrist: length, stiffness, hand | springs | tendons [kN/m] | controller | motion | load [kg] "
        "| limit of tension [N] | true pull [N] | true error [deg] | end |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]  # fmt: skip
    for number, ended in ends.items():
        wrist, settings = drawn(number)
        bench, reference = settings["bench"], settings["reference"]
        motion = reference.get("kind", settings["directions"][0])
        lines.append(
            f"| {number} | {settings.get('planes', 1)} | {1e3 * wrist.length:.0f} mm, {wrist.stiffness:.2g} N m/rad, "
            f"{wrist.hand_mass:.2g} kg | {bench['plant']['stiffness_scale']:.2f} "
            f"| {1e-3 * bench['actuator']['tendon_stiffness']:.0f} | {settings['controllers'][0]['controller']} "
            f"| {motion}, {reference['angle_deg']:.0f} deg | {settings.get('payload', 0.0):.2g} | {ended.limit:.0f} "
            f"| {ended.pull:.0f} | {np.degrees(ended.error):.1f} | {ended.outcome.replace('|', '/')[:160]} |"
        )
    return "\n".join(lines) + "\n"


def main() -> int:
    """Try rigs, name those that were stopped, and write the page of those from the first on."""
    asked = options(__doc__, RIGS, "sound-rigs").parse_args()
    ends: dict[int, Ended] = {}
    for number, kept in tried(asked, ended_on):
        ends[number] = ended = Ended(*kept)
        print(f"rig {number}: {ended.outcome}; {ended.odd}", flush=True)
        if ended.outcome != "ok":
            print(json.dumps(drawn(number).settings, default=list), flush=True)
    stopped = sum(ended.outcome != "ok" for ended in ends.values())
    print(f"{len(ends) - stopped} of {len(ends)} sound rigs went through")
    if asked.first == 0:
        PAGE.write_text(page(ends))
    return stopped


if __name__ == "__main__":
    sys.exit(main())
