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

from tests.drawn_rigs import COMMITTED, ended, options, tried
from tests.trial.conftest import WRIST
from tests.trial.fault_runs import camera_before, injecting, needed, over, rig_settings
from tests.trial.largest_pulls import folded
from tests.trial.single_trials import Ended, performed
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller
from wristctl.trial.motion_limit import asked_at_most
from wristctl.trial.resting import sag_of
from wristctl.tuning.scaled_presets import scaled_to
from wristctl.wrist.statics import least_stiffness

SEED = 20261123
RIGS = 100
PAGE = Path(__file__).parents[2] / "docs" / "hardware" / "sound-rigs.md"
LAWS = "smc-tracking", "ct-dob", "pid-ff", "pid-dob", "adrc", "lqi", "mpc", "impedance", "mrac"
TAKEN = 0.3
"""When the hand takes up its load: seconds after the motion began."""
_IN_HAND = 1.2
"""By how much springs are stiffer than what holds the hand up."""
REFUSED, SLIPPED = "refused", "a motor slipped"
"""How ends begin of rigs that are not to be tried, and that motors cannot move."""
RUBS_DEG = 5.0
"""Bend at which friction inside a wrist holds it at most: one that is held at more is refused in homing, by that."""
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
    plant = settings["bench"]["plant"]
    slack = {"stiffness": plant["stiffness_scale"] * wrist.stiffness, "pretension": 0.0}
    most = math.radians(RUBS_DEG) * least_stiffness(wrist.model_copy(update=slack), 1)
    settings = over(settings, {"bench": {"plant": {"inner_friction": min(most, plant["inner_friction"])}}})
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
    """Another wrist, upright, that does not buckle with its springs weakened so, a fifth in hand."""
    while True:
        stiffness = math.exp(rng.uniform(math.log(0.2), math.log(3.0)))
        length, hand = float(rng.uniform(0.06, 0.14)), float(rng.uniform(0.0, 0.5))
        wrist = WristParameters(length=length, stiffness=stiffness, hand_mass=hand)
        if math.isfinite(sag_of(wrist.model_copy(update={"stiffness": weakened / _IN_HAND * stiffness}), "ulnar")):
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
    """How the trial of this rig ended, or that its motion needs more than `hw-run` lets real motors try.

    Where it is stopped, a tendon truly pulled what a motor has, and the friction of its sheaths asks for more, that has
    slipped.
    """
    wrist, settings = drawn(number)
    asked = HwRunSettings.model_validate(settings)
    if (need := needed(asked, wrist)) > (most := asked_at_most(asked, wrist)):
        return Ended(
            f"{REFUSED}: it needs {need:.0f} N, and {most:.0f} N is asked of motors", "", math.nan, math.nan, math.nan
        )
    taken = {"kind": "payload-taken", "size": settings.get("payload", 0.0), "at": TAKEN, "since": "first trial"}
    end = performed(settings, injecting([taken] if "payload" in settings else []), wrist, seed=number)
    tendons, pulls = settings["bench"]["actuator"], asked.safety.motor_pull
    at_motor = need * math.exp(tendons["friction"] * tendons["sheath"])
    if end.outcome == "ok" or min(at_motor, end.pull) < pulls:
        return end
    return end._replace(outcome=f"{SLIPPED}: it pulls {pulls:.0f} N, and {at_motor:.0f} N is asked: {end.outcome}")


def page(ends: dict[int, Ended]) -> str:
    """The table: a row for each rig."""
    stopped, left = len(stopped_of(ends)), RIGS - len(ends)
    beyond, slipped = (sum(end.outcome.startswith(how) for end in ends.values()) for how in (REFUSED, SLIPPED))
    others = ""
    if beyond:
        others += (
            f"Of {beyond} more the motion is refused before a motor turns: it needs more than motors are asked for."
        )
    if slipped:
        others += f" Of {slipped} a motor slips, since its sheath rubs: they are stopped, as they should."
    told = f"""
        {len(ends) - beyond - slipped} sound rigs were drawn, homed and tried once; stopped: {stopped}. {others} Drawn
        are springs of 0.6 to 1.2 of what is believed, tendons of 5 to 50 kN/m (believed: 20), pulleys, sheaths of 0 to
        2 rad, friction, creep, poses and lenses of cameras, light, latency and USB adapter. Every second wrist has
        another length, stiffness and hand, and gains scaled to it; gains are 0.7 to 1.2 of the preset `hardware`; every
        fourth hand takes up a load that was declared; every fifth rig bends in two planes. Springs are stiffer than
        what holds the hand up by a fifth at least, and friction inside holds a wrist bent by {RUBS_DEG:g} deg at most.
        A person pushes against the bend. Made by `make sound-rigs`{f"; {left} more are to be tried" if left else ""}.
    """
    lines = [
        "# Sound rigs that are stopped all the same", "",
        folded(told), "",
        "| rig | planes | wrist: length, stiffness, hand | springs | tendons [kN/m] | controller | motion | load [kg] "
        "| limit of tension [N] | true pull [N] | true error [deg] | end |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]  # fmt: skip
    for number, end in ends.items():
        wrist, settings = drawn(number)
        bench, reference = settings["bench"], settings["reference"]
        motion, came = reference.get("kind", settings["directions"][0]), end.outcome.replace("|", "/")[:160]
        lines.append(
            f"| {number} | {settings.get('planes', 1)} | {1e3 * wrist.length:.0f} mm, {wrist.stiffness:.2g} N m/rad, "
            f"{wrist.hand_mass:.2g} kg | {bench['plant']['stiffness_scale']:.2f} "
            f"| {1e-3 * bench['actuator']['tendon_stiffness']:.0f} | {settings['controllers'][0]['controller']} "
            f"| {motion}, {reference['angle_deg']:.0f} deg | {settings.get('payload', 0.0):.2g} "
            f"| {_cell(end.limit)} | {_cell(end.pull)} | {_cell(math.degrees(end.error), 1)} | {came} |"
        )
    return "\n".join(lines) + "\n"


def _cell(value: float, digits: int = 0) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else "-"


def stopped_of(ends: dict[int, Ended]) -> list[int]:
    """Numbers of the rigs that were stopped, in homing or in a trial."""
    return [number for number, ended in ends.items() if not ended.outcome.startswith(("ok", REFUSED, SLIPPED))]


def main() -> int:
    """Try rigs, name those that were stopped, and write the page of all that were tried."""
    asked = options(__doc__, RIGS, "sound-rigs", COMMITTED).parse_args()
    for number, kept in tried(asked, ended_on):
        came = Ended(*kept)
        print(f"rig {number}: {came.outcome}; {came.odd}", flush=True)
        if stopped_of({number: came}):
            print(json.dumps(drawn(number).settings, default=list), flush=True)
    ends = {number: Ended(*kept) for number, kept in ended(asked).items()}
    PAGE.write_text(page(ends))
    stopped = len(stopped_of(ends))
    print(f"{stopped} of {len(ends)} sound rigs were stopped")
    return stopped


if __name__ == "__main__":
    sys.exit(main())
