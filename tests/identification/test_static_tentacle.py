"""A rod at rest: a circle where nothing weighs, straight where nothing pulls, as closed forms have it."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.documented import script_of_docs

Tentacle = script_of_docs("static_tentacle").Tentacle

ROD = Tentacle(0.36, (0.01, 0.01), 0.008, 0.0, (0.0, -math.tau / 3.0), 0.0, (0.12, 0.345))
STIFF, LIGHT = 4.0, 1e-6
"""Modulus [MPa] and density [1e3 kg/m^3]."""


def values(modulus: float, density: float, rod: Any = ROD, turn: float = 0.0) -> np.ndarray:
    begin = rod.begin
    begin[:3] = modulus, density, turn
    return begin


def test_without_weight_a_pull_bends_the_rod_into_a_circle_toward_its_tendon() -> None:
    area, inertia = math.pi * 0.01**2, 0.25 * math.pi * 0.01**4
    curvature = 3.0 * 0.008 / (STIFF * 1e6 * inertia)
    stretch = 1.0 - 3.0 / (STIFF * 1e6 * area)
    for turn in (0.0, 0.7):
        (markers,) = ROD.expected(values(STIFF, LIGHT, turn=turn), np.array([[3.0, 0.0]]))
        for place, along in zip(markers, ROD.markers, strict=True):
            radius, angle = stretch / curvature, curvature * along
            across = radius * (1.0 - math.cos(angle))
            expected = [radius * math.sin(angle), across * math.cos(turn), across * math.sin(turn)]
            np.testing.assert_allclose(place, expected, atol=4e-4)


def test_a_rod_that_hangs_is_straight_and_longer_by_its_weight() -> None:
    (markers,) = ROD.expected(values(0.3, 1.2), np.zeros((1, 2)))
    sag = 1200.0 * 9.81 * (0.36 * 0.345 - 0.5 * 0.345**2) / 0.3e6
    np.testing.assert_allclose(markers[1], [0.345 + sag, 0.0, 0.0], atol=2e-4)


def test_weight_holds_the_rod_back_and_equal_pulls_bend_it_between_their_tendons() -> None:
    pulls = np.array([[3.0, 0.0], [1.5, 1.5]])
    light, heavy = (ROD.expected(values(0.5, density), pulls) for density in (LIGHT, 1.2))
    assert heavy[0, 1, 1] < 0.7 * light[0, 1, 1]
    assert math.degrees(math.atan2(heavy[1, 1, 2], heavy[1, 1, 1])) == pytest.approx(-60.0, abs=0.1)


def test_a_little_weight_lessens_a_small_bend_as_beam_theory_has_it() -> None:
    short = replace(ROD, markers=(0.18, 0.345))
    (bent,) = short.expected(values(20.0, 0.1, short), np.array([[3.0, 0.0]]))
    (free,) = short.expected(values(20.0, LIGHT, short), np.array([[3.0, 0.0]]))
    weight = 100.0 * math.pi * 0.01**2 * 9.81
    inertia = 20e6 * 0.25 * math.pi * 0.01**4
    curvature = 3.0 * 0.008 / inertia
    # of a circle y = c x^2 / 2 under its weight w per length: E I dy'' = -w int_x^L (y(s) - y(x)) ds, to first order
    x = np.linspace(0.0, 0.36, 2001)
    y = 0.5 * curvature * x**2
    moment = -weight * np.array([np.trapezoid(y[k:] - y[k], x[k:]) for k in range(len(x))])
    slope = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(x) * (moment[1:] + moment[:-1]))]) / inertia
    less = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(x) * (slope[1:] + slope[:-1]))])
    assert bent[1, 1] - free[1, 1] == pytest.approx(float(np.interp(0.345, x, less)), rel=0.05)
