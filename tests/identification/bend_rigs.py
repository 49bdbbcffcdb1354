"""Rehearsed benches in two planes, drawn with springs, tendons and small errors of their own, and what they tell."""

from __future__ import annotations

import math
from functools import cache
from typing import NamedTuple

import numpy as np

from tests.identification.bend_rehearsal import RehearsedBends, planned_spools, rehearse_bends
from wristctl.arrays import Array
from wristctl.config.identify import IdentifySettings
from wristctl.config.plant import Actuator
from wristctl.config.wrist import WristParameters
from wristctl.identification.arc_fit import Told
from wristctl.identification.bend_estimates import told_of_bends
from wristctl.identification.fit import Fit, fit
from wristctl.identification.intervals import Knowledge, knowledge
from wristctl.identification.lack_of_fit import misfits
from wristctl.identification.measured_trials import places_of_log, trials_of_logs
from wristctl.identification.problem import bend_problem
from wristctl.identification.unknowns import oblique_of, springs_of
from wristctl.records.open_log import OpenLog
from wristctl.wrist.tendon_layout import TendonLayout, TendonPlace

KNOWN, TENDONS = WristParameters(), Actuator(level="tendon")
LAYOUT = TendonLayout.of(KNOWN)
NUMBERS = (1, 2, 4, 5)
MASSES = {"hand": 0.3, "light": 0.1}
SEGMENTS = 2
SETTINGS = IdentifySettings(segments=SEGMENTS, exposure=4e-3)
spools = cache(lambda: planned_spools(KNOWN, TENDONS, LAYOUT))


class Rig(NamedTuple):
    """A bench that nobody knows: its wrist, tendons and their places."""

    wrist: WristParameters
    actuator: Actuator
    layout: TendonLayout

    def truth(self, axis: float) -> dict[str, float]:
        """True values by the names of what is told, the ellipse by whichever of its axes is nearer to `axis` [deg]."""
        springs = springs_of(*oblique_of(self.wrist))
        along, across = springs["stiffness"], springs["flexion_ratio"] * springs["stiffness"]
        own = springs["stiffness_axis_deg"]
        if abs(axis - own) > 45.0:
            along, across, own = across, along, own + math.copysign(90.0, axis - own)
        values = {"stiffness": along, "stiffness_across": across, "stiffness_axis_deg": own}
        values |= {"damping": self.wrist.damping, "delay": 0.03}
        for number, place in zip(NUMBERS, self.layout.places, strict=True):
            values[f"direction_{number}"] = math.degrees(place.angle)
            values[f"gain_{number}"] = KNOWN.tendon_radius / place.radius
        tendons = {name: getattr(self.actuator, name) for name in ("tendon_stiffness", "friction", "presliding")}
        return values | tendons | {"sheath_friction": self.actuator.friction * self.actuator.sheath}


def drawn_rig(rng: np.random.Generator) -> Rig:
    """Springs up to 30 % weaker and of any axis, tendons 2 deg and 1 % off their places and 20 % off in stiffness."""
    # Weaker across than 0.75 times that, a loose wrist would hang over.
    ratio = rng.choice([rng.uniform(0.75, 0.9), rng.uniform(1.1, 1.35)])
    wrist = KNOWN.model_copy(
        update={
            "stiffness": KNOWN.stiffness * rng.uniform(0.7, 1.0),
            "flexion_ratio": float(ratio),
            "stiffness_axis_deg": rng.uniform(-45.0, 45.0),
            "damping": KNOWN.damping * rng.uniform(0.8, 1.2),
        }
    )
    tendons = {
        "tendon_stiffness": 2e4 * rng.uniform(0.8, 1.2),
        "friction": rng.uniform(0.05, 0.15),
        "sheath": rng.uniform(0.3, 1.0),
    }
    places = tuple(
        TendonPlace(place.angle + aside, place.radius * (1.0 + wider))
        for place, aside, wider in zip(
            LAYOUT.places, np.radians(2.0 * rng.standard_normal(4)), 0.01 * rng.standard_normal(4), strict=True
        )
    )
    return Rig(wrist, TENDONS.model_copy(update=tendons), TendonLayout(places))


def logs_of(
    rig: Rig, rng: np.random.Generator, segments: int = SEGMENTS, counts: Array | None = None,
    tension_noise: float | None = None,
) -> list[OpenLog]:  # fmt: skip
    """The logs of its two runs, one a mass of the hand; each has been homed and its camera zeroed anew.

    Views are turned and scaled as far off as the settings say, alike in both runs.
    """
    (of_views,) = rng.spawn(1)
    turn, too_much = (
        SETTINGS.turn_error_deg * of_views.standard_normal(2),
        SETTINGS.view_error * of_views.standard_normal(2),
    )
    clock = SETTINGS.clock_error * rng.standard_normal()
    logs = []
    for name, mass in MASSES.items():
        zero, taut = 0.1 * rng.standard_normal(2), 2e-5 * rng.standard_normal(4)
        wrist = rig.wrist.model_copy(update={"hand_mass": mass})
        truth = RehearsedBends(
            wrist, rig.actuator, rig.layout, taut=tuple(taut), delay=0.03 + clock, zero_deg=(zero[0], zero[1]),
            turn_deg=(turn[0], turn[1]), too_much=(too_much[0], too_much[1]),
            segments=segments, tension_noise=tension_noise,
        )  # fmt: skip
        logs.append(rehearse_bends(truth, spools() if counts is None else counts, TENDONS.step_length, rng, name=name))
    return logs


class Identified(NamedTuple):
    """What logs tell."""

    fit: Fit
    knowledge: Knowledge
    told: dict[str, Told]
    misfit: float
    """Largest chi-square over its degrees of freedom."""


def identified(logs: list[OpenLog], settings: IdentifySettings = SETTINGS) -> Identified:
    """What logs tell to somebody who believes in the wrist of the study."""
    trials = trials_of_logs(logs, KNOWN, settings.step, settings.exposure or 0.0)
    problem = bend_problem(trials, places_of_log(logs[0], KNOWN), KNOWN, TENDONS, settings)
    found = fit(problem)
    known = knowledge(found)
    return Identified(found, known, told_of_bends(found, known), max(one.ratio for one in misfits(found)))
