"""Hysteresis loops and dead bands of a wrist: against the statics, speed, symmetry, and figures measured otherwise."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from wristctl.config.hysteresis import HysteresisSettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.simulation.hysteresis import HysteresisLoop, dead_bands, friction_cases, loops, main_case
from wristctl.simulation.strokes import FrictionCase, Strokes, strokes
from wristctl.wrist.statics import least_stiffness
from wristctl.wrist.tendons import TENDONS_PER_SIDE

WRIST, STROKES = WristParameters(), HysteresisSettings()


def stroke(**own: Any) -> Strokes:
    """What moves a wrist by settings that differ so from the default ones."""
    return strokes(WRIST, HysteresisSettings.model_validate({"ranges_deg": ((0.0, 30.0),), "angles_deg": ()} | own))


@pytest.fixture(scope="module")
def driven() -> dict[tuple[float, float], HysteresisLoop]:
    """Slow loops of bare tendons and of long sheaths, by sheath and speed."""
    own = stroke(sheaths=(0.0, 3.0), frequencies=(0.002, 0.02, 0.2))
    return {(each.case.tendons.sheath, each.case.frequency): each for each in loops(own)}


@pytest.mark.parametrize(
    ("sheath", "works", "close"), [(0.0, (6.438, 6.437, 6.427), 2e-4), (3.0, (67.07, 66.93, 65.54), 3e-3)]
)
@pytest.mark.slow
def test_works_are_those_of_an_independent_prototype(
    driven: dict[tuple[float, float], HysteresisLoop], sheath: float, works: tuple[float, ...], close: float
) -> None:
    """0 to 30 deg and back at 0.002, 0.02 and 0.2 Hz [mJ], by another implementation of the same element."""
    found = [1e3 * driven[sheath, frequency].friction_work for frequency in (0.002, 0.02, 0.2)]
    np.testing.assert_allclose(found, works, rtol=close)


@pytest.mark.parametrize("sheath", [0.0, 3.0])
def test_friction_takes_the_same_at_every_slow_speed_and_damping_more(
    driven: dict[tuple[float, float], HysteresisLoop], sheath: float
) -> None:
    slow, ten, hundred = (driven[sheath, frequency] for frequency in (0.002, 0.02, 0.2))
    assert ten.friction_work == pytest.approx(slow.friction_work, rel=0.01)
    assert ten.damped_work == pytest.approx(10.0 * slow.damped_work, rel=0.01)
    for each in (slow, ten, hundred):
        rest = each.raw_work - each.friction_work - each.damped_work
        assert abs(rest) < 0.005 * each.raw_work, (
            "nothing else takes any: damping is that of rates at the ends of steps"
        )
        assert each.course.theta[0] == pytest.approx(each.course.theta[-1], abs=1e-6), "it closes"


def test_a_slow_loop_is_as_wide_as_the_roots_of_the_statics_are_apart(
    driven: dict[tuple[float, float], HysteresisLoop],
) -> None:
    """But for what the wrist's damping lags: its torque over the stiffness of held spools."""
    for sheath in (0.0, 3.0):
        slow, fast = driven[sheath, 0.002], driven[sheath, 0.02]
        lag = fast.width - slow.width
        assert slow.width - lag / 9.0 == pytest.approx(slow.exact_width, rel=0.003) and lag > 0.0
        middle = slow.course.theta[(len(slow.time) - 1) // 4], slow.course.theta[3 * (len(slow.time) - 1) // 4]
        assert middle[1] < np.radians(15.0) < middle[0]


@pytest.mark.parametrize("ramp", [5.0, 9.0])
@pytest.mark.slow
def test_ramps_leave_held_spools_at_the_roots_of_the_statics(ramp: float) -> None:
    settings = {"preslidings": (5e-6, 2e-5, 1e-4), "frictions": (0.05, 0.2), "angles_deg": (4.0, 15.0, 27.0)}
    found = dead_bands(stroke(ramp=ramp, **settings))
    assert len(found) == 2 * 3 * 3 * 3 and all(each.slid for each in found)
    for each in found:
        assert each.width == pytest.approx(each.exact_width, rel=0.01)
        assert abs(each.below - each.exact_below) < 0.01 * each.exact_width
        assert each.exact_below < each.unhindered < each.exact_above


@pytest.mark.parametrize("drive", ["spools", "tensions"])
def test_friction_alone_holds_a_wrist_between_two_roots_about_its_angle_and_elastic_spools_narrow_them(
    drive: str,
) -> None:
    """By the capstan on bare tendons: a torque of mu phi times the pulls' arms, over the stiffness that is felt."""
    own, bend = stroke(drive=drive), math.radians(20.0)
    found = own.exact([FrictionCase(0.0, 0.0, 2e-5), FrictionCase(0.02, 0.0, 2e-5)], np.full(2, bend))
    assert found[0] == pytest.approx([bend, bend], abs=1e-9)
    below, above = found[1]
    assert below < bend < above and 0.5 * (below + above) == pytest.approx(bend, abs=0.1 * (above - below))
    pulls = own.given(np.array(bend)) if drive == "tensions" else stroke(drive="tensions").given(np.array(bend))
    lost = 0.02 * bend * float(pulls.sum()) * WRIST.tendon_offset
    springs = least_stiffness(WRIST, STROKES.segments)
    spools = 2.0 * TENDONS_PER_SIDE * STROKES.tendon_stiffness * WRIST.tendon_offset**2
    felt = springs + spools if drive == "spools" else springs
    assert spools > 10.0 * springs and above - below == pytest.approx(2.0 * lost / felt, rel=0.2)


def test_held_pulls_leave_a_dead_band_many_times_as_wide() -> None:
    """By the springs alone: the spools' tendons had most of the stiffness."""
    wide, narrow = (
        next(each for each in dead_bands(stroke(drive=drive, sheaths=(1.0,), angles_deg=(15.0,))))
        for drive in ("tensions", "spools")
    )
    assert wide.slid and wide.width == pytest.approx(wide.exact_width, rel=0.01)
    assert 40.0 < wide.width / narrow.width < 55.0


def test_ramps_that_do_not_slide_far_enough_are_told_from_those_that_do() -> None:
    """Against pulls that hardly overcome 3 rad of sheath, from an end of the range 5 deg away."""
    near, far = dead_bands(stroke(drive="tensions", sheaths=(3.0,), angles_deg=(15.0, 25.0)))
    assert near.slid and not far.slid and far.width < 0.9 * far.exact_width


@pytest.mark.slow
def test_an_inner_loop_lies_in_the_outer_one() -> None:
    own = stroke(ranges_deg=((0.0, 30.0), (10.0, 20.0)), frequencies=(0.01,), sheaths=(1.0,))
    outer, inner = loops(own)
    assert inner.friction_work < outer.friction_work / 2.5
    half = len(outer.time) // 2
    down, up = (
        np.interp(inner.course.theta, outer.course.theta[part][::order], outer.course.spool[..., 0][part][::order])
        for part, order in ((slice(0, half + 1), -1), (slice(half, None), 1))
    )
    assert (inner.course.spool[..., 0] > down - 0.02).all() and (inner.course.spool[..., 0] < up + 0.02).all()
    assert np.ptp(inner.course.spool[..., 0]) > 0.9 * np.abs(up - down).max()


def test_a_loop_to_the_other_side_is_the_mirror_image() -> None:
    right, left = (
        loops(stroke(ranges_deg=((low, high),), frequencies=(0.5,), sheaths=(1.0,)))[0]
        for low, high in ((-5.0, 25.0), (-25.0, 5.0))
    )
    half = len(right.time) // 2
    shifted = np.concatenate([left.course.theta[half:-1], left.course.theta[: half + 1]])
    np.testing.assert_allclose(shifted, -right.course.theta, atol=1e-6)
    assert left.friction_work == pytest.approx(right.friction_work, rel=1e-5)


def test_a_triangle_goes_at_one_speed() -> None:
    (done,) = loops(stroke(shape="triangle", frequencies=(0.02,), sheaths=(1.0,)))
    steps = np.abs(np.diff(done.unhindered))
    down, up = np.linspace(30.0, 0.0, 101), np.linspace(0.0, 30.0, 101)
    np.testing.assert_allclose(np.degrees(done.unhindered), [*down, *up[1:]], atol=1e-9)
    assert done.course.theta[0] == pytest.approx(done.course.theta[-1], abs=1e-6), "it closes"
    np.testing.assert_allclose(steps, np.radians(30.0) / 100.0, rtol=1e-9)
    assert done.unhindered[0] == pytest.approx(np.radians(30.0)) and done.unhindered[100] == pytest.approx(
        0.0, abs=1e-12
    )


def test_more_friction_takes_more() -> None:
    found = loops(stroke(frictions=(0.0, 0.05, 0.1), sheaths=(1.0,), frequencies=(0.1,)))
    none, some, more = (each.friction_work for each in found)
    assert none == 0.0 and more == pytest.approx(2.0 * some, rel=0.02) and some > 1e-3


def test_of_no_friction_there_is_one_kind() -> None:
    settings = HysteresisSettings(frictions=(0.0, 0.1), sheaths=(3.0, 0.0, 1.0), preslidings=(2e-5, 1e-4))
    assert len(friction_cases(settings)) == 1 + 3 * 2
    assert main_case(settings).friction == 0.0
    chosen = main_case(settings.model_copy(update={"frictions": (0.1,)}))
    assert chosen == (0.1, 1.0, 2e-5)


@pytest.mark.parametrize(
    ("own", "wrist", "words"),
    [
        ({"ranges_deg": ((0.0, 60.0),)}, {}, "beyond the wrist's range, 50 deg"),
        ({"drive": "tensions"}, {"hand_mass": 0.8}, "buckles on held pulls"),
        ({}, {"stiffness": 10.0}, "a tendon, above wrist.tension_limit"),
    ],
)
def test_loops_that_a_wrist_cannot_go_through_are_refused(own: Any, wrist: Any, words: str) -> None:
    settings = HysteresisSettings.model_validate({"ranges_deg": ((0.0, 30.0),), "angles_deg": ()} | own)
    with pytest.raises(UserError, match=words):
        strokes(WRIST.model_copy(update=wrist), settings)


def test_on_spools_a_wrist_that_would_buckle_on_pulls_goes_on() -> None:
    own = strokes(WRIST.model_copy(update={"hand_mass": 0.8}), HysteresisSettings(frequencies=(1.0,)))
    assert all(np.isfinite(each.course.theta).all() for each in loops(own))


LIVELY = WristParameters(damping=1e-4)
STIFF: dict[str, Any] = {"tendon_stiffness": 5e5, "shape": "triangle", "ranges_deg": ((0.0, 30.0),), "angles_deg": ()}


def lively(**own: Any) -> HysteresisLoop:
    """The loop of a wrist that hardly damps, on stiff tendons that turn with a jerk."""
    settings = HysteresisSettings.model_validate(STIFF | {"sheaths": (3.0,), "frequencies": (0.5,)} | own)
    return loops(strokes(LIVELY, settings))[0]


@pytest.mark.parametrize("step", [2e-3, 1e-3])
@pytest.mark.slow
def test_a_loop_takes_as_many_steps_as_it_needs_and_says_how_many(step: float) -> None:
    found, fine = lively(step=step), lively(step=1e-5)
    assert found.step < 2e-4 and found.drift == fine.drift == 0.0
    assert found.damped_work == pytest.approx(fine.damped_work, rel=0.02)
    assert found.width == pytest.approx(fine.width, abs=np.radians(0.004))
    samples = len(found.time) - 1
    assert found.time[-1] == pytest.approx(2.0) and 2.0 / samples / found.step == pytest.approx(
        round(2.0 / samples / found.step)
    )


@pytest.mark.slow
def test_what_still_changes_at_the_shortest_step_is_marked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("wristctl.simulation.hysteresis.FINER", (2,))
    open_ = lively(step=1e-3)
    assert open_.drift > 0.01 and open_.step == pytest.approx(5e-4)
    monkeypatch.undo()
    assert abs(open_.damped_work / lively(step=1e-5).damped_work - 1.0) > 0.01, "it had not settled"


def test_a_quiet_loop_keeps_the_step_of_its_study(driven: dict[tuple[float, float], HysteresisLoop]) -> None:
    assert {round(each.step, 9) for each in driven.values()} == {1e-3}
    assert not any(each.drift for each in driven.values())


def test_only_the_dead_band_that_needs_them_takes_more_steps() -> None:
    """Beside a slow ramp's on the same wrist, the jerk of a quick one does not fade soon."""
    slow, quick = (
        dead_bands(strokes(LIVELY, HysteresisSettings.model_validate(
            {**STIFF, "ramp": ramp, "angles_deg": (15.0,), "sheaths": (0.0, 3.0)}
        )))
        for ramp in (7.0, 1.0)
    )  # fmt: skip
    assert all(each.drift == 0.0 for each in (*slow, *quick))
    assert quick[1].step < slow[1].step == pytest.approx(1e-3)
