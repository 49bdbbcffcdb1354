"""The forward model's angles: at rest first, mirrored with the spools, and each candidate its own."""

from __future__ import annotations

import numpy as np
import pytest

from tests.identification.benches import KNOWN, LEVEL, TENDONS, tendons
from wristctl.arrays import Array
from wristctl.bench.bench_wrist import BenchWrist
from wristctl.bench.motors import CYCLES
from wristctl.board.emulator.atmega2560 import EDGE
from wristctl.config.bench import BenchSettings, Motors
from wristctl.config.identify import IdentifySettings
from wristctl.config.plant import TendonFacts
from wristctl.identification.forward import Places, Supposed, across_plane, courses
from wristctl.identification.rotor_field import Rotors, rotors_of, with_rotors
from wristctl.wrist.directions import ACTIVE, DIRECTIONS, in_plane, tendons_of
from wristctl.wrist.statics import equilibrium
from wristctl.wrist.tendon_layout import TendonLayout

STIFF, STEP = 20e3, 1e-3


def held(plus: float, minus: float, steps: int = 200) -> Array:
    return np.tile([plus, plus, minus, minus], (steps, 1))


def test_a_wrist_is_at_rest_on_its_first_spool_positions() -> None:
    """Level, where gravity bends it: no angle moves while the spools stand."""
    soft = LEVEL.model_copy(update={"stiffness": 0.8})
    course = courses([Supposed(soft, tendons(STIFF, 0.1))], held(2e-4, 2e-4), STEP, 4)[0, :, 0]
    assert abs(course[0]) > 1e-3 and np.ptp(course) < 0.01 * abs(course[0])


def test_the_pull_is_what_a_tendon_is_stretched_by() -> None:
    """Without friction: k times what is reeled in more than the path is shorter by, and never a push."""
    plus, minus = 1.2e-3, 1e-4
    bent = courses([Supposed(KNOWN, tendons(STIFF, 0.0))], held(plus, minus, 600), STEP, 4)[0, -1, 0]
    arm = KNOWN.tendon_offset
    pulls = [max(0.0, STIFF * (reeled - sign * arm * bent)) for reeled, sign in ((plus, 1.0), (minus, -1.0))]
    assert bent == pytest.approx(equilibrium(KNOWN, 4, (pulls[0], pulls[1])).sum(), rel=0.02)
    assert 0.02 < bent < plus / arm


def test_mirrored_spools_bend_the_upright_wrist_the_other_way() -> None:
    swing = 1e-3 * np.sin(np.linspace(0.0, 3.0, 200))
    reeled = 3e-4 + np.stack([swing, swing, -swing, -swing], axis=1)
    candidate = Supposed(KNOWN, tendons(STIFF, 0.1))
    one, other = (courses([candidate], each, STEP, 4)[0, :, 0] for each in (reeled, reeled[:, [2, 3, 0, 1]]))
    assert np.abs(one).max() > 0.02
    np.testing.assert_allclose(other, -one, atol=1e-9)
    swapped = courses([candidate], reeled[:, [1, 0, 3, 2]], STEP, 4)[0, :, 0]
    np.testing.assert_allclose(swapped, one, atol=1e-12, err_msg="tendons of a side are alike")


def test_each_candidate_is_as_it_would_be_alone_and_its_own_tautness_counts_as_reeled_in() -> None:
    reeled = held(6e-4, 2e-4)
    taut = (1e-4, -5e-5, 2e-4, 3e-5)
    candidates = [
        Supposed(KNOWN, tendons(STIFF, 0.1)),
        Supposed(LEVEL, tendons(5e3, 0.0)),
        Supposed(KNOWN, tendons(STIFF, 0.1), taut),
    ]
    together = courses(candidates, reeled, STEP, 4)[..., 0]
    assert together.shape == (3, 200)
    for at, candidate in enumerate(candidates):
        np.testing.assert_allclose(together[at], courses([candidate], reeled, STEP, 4)[0, :, 0], atol=1e-9)
    np.testing.assert_allclose(
        together[2], courses(candidates[:1], reeled + np.array(taut), STEP, 4)[0, :, 0], atol=1e-9
    )


HOLDING = 0.32


def given_way(pull: Array) -> Array:
    """What rotors give way beyond the first order [m]: four full steps are a turn of the field."""
    share, radian = (
        pull * TENDONS.pulley_radius / HOLDING,
        4.0 * 2.0 * np.pi * TENDONS.pulley_radius / 200 / (2.0 * np.pi),
    )
    beyond: Array = radian * (np.arcsin(share) - share)
    return beyond


LAYOUT = TendonLayout.four(KNOWN.tendon_radius)
RIGID = Supposed(KNOWN, tendons(STIFF, 0.0), places=Places.of(LAYOUT, KNOWN.discs))


def test_a_rotor_gives_way_by_the_arc_sine_of_its_pull() -> None:
    reeled = np.tile([2.2e-3, 1.9e-3, 4e-4, 5e-4], (600, 1))
    yielding = courses([RIGID._replace(rotors=Rotors(HOLDING))], reeled, STEP, 2, pulls=True)[0, -1]
    less = given_way(yielding[2:])
    assert less.max() > 2e-6
    without, with_less = (courses([RIGID], each, STEP, 2, pulls=True)[0, -1] for each in (reeled, reeled - less))
    assert np.abs(with_less - yielding).max() < 0.05 * np.abs(without - yielding).max()


def test_in_one_plane_rotors_give_way_as_in_two() -> None:
    plus, minus = 2.2e-3, 4e-4
    both = np.tile([minus, minus, plus, plus], (600, 1))
    wrists = [RIGID, RIGID._replace(rotors=Rotors(HOLDING))]
    ulnar = [float(courses([wrist], both, STEP, 2, pulls=True)[0, -1, 0]) for wrist in wrists]
    supposed = [Supposed(KNOWN, tendons(STIFF, 0.0), rotors=Rotors(holding)) for holding in (np.inf, HOLDING)]
    alone = [float(course[-1, 0]) for course in courses(supposed, held(plus, minus, 600), STEP, 2)]
    assert ulnar[0] - ulnar[1] > 1e-5
    assert alone[0] - alone[1] == pytest.approx(ulnar[0] - ulnar[1], rel=0.05)


def test_in_one_plane_pulls_are_those_of_the_tendons_in_the_order_of_their_spools() -> None:
    """Without friction: k times what each has reeled in more than its path is shorter by."""
    reeled = np.tile([1.2e-3, 9e-4, 1e-4, -9e-4], (600, 1))
    (course,) = courses([Supposed(KNOWN, tendons(STIFF, 0.0))], reeled, STEP, 1, pulls=True)
    bend, pulls = course[-1, 0], course[-1, 1:]
    stretch = reeled[0] - KNOWN.tendon_offset * bend * np.array([1.0, 1.0, -1.0, -1.0])
    assert pulls == pytest.approx(STIFF * stretch.clip(0.0), rel=0.02) and pulls[3] == 0.0 < pulls[:3].min()


def test_in_two_planes_a_tendon_that_has_broken_leaves_the_wrist_to_the_others() -> None:
    reeled = np.tile([1.1e-3, 7e-4, 9e-4, 5e-4], (800, 1))
    broken = RIGID._replace(facts=TendonFacts(broken_at=0.1, broken_tendon=2))
    course, loose = (
        courses([each], lengths, STEP, 1)[0]
        for each, lengths in ((broken, reeled), (RIGID, reeled - np.array([0.0, 1.0, 0.0, 0.0])))
    )
    (whole,) = courses([RIGID], reeled, STEP, 1)
    np.testing.assert_allclose(course[:100], whole[:100], atol=1e-12)
    assert np.linalg.norm(course[-1] - whole[-1]) > 1e-2
    np.testing.assert_allclose(course[-1], loose[-1], atol=1e-6)


SWINGING = Rotors(HOLDING, 3.07e-5, 2e-3)


def test_a_rotor_that_swings_comes_to_rest_where_one_that_stands_is() -> None:
    """In one plane and in two; the stiffness that is given is that of tendon and field in series."""
    uneven = np.tile([2.2e-3, 1.9e-3, 4e-4, 5e-4], (600, 1))
    supposed = [Supposed(KNOWN, tendons(STIFF, 0.0), rotors=rotors) for rotors in (Rotors(HOLDING), SWINGING)]
    standing, swung = (float(courses([each], uneven, STEP, 4)[0, -1, 0]) for each in supposed)
    rigid = float(courses([supposed[0]._replace(rotors=Rotors())], uneven, STEP, 4)[0, -1, 0])
    assert abs(rigid - standing) > 2e-5 and swung == pytest.approx(standing, abs=0.1 * abs(rigid - standing))
    swinging = RIGID._replace(rotors=SWINGING), RIGID._replace(rotors=Rotors(HOLDING))
    in_two = [courses([each], uneven, STEP, 2, pulls=True)[0, -1] for each in reversed(swinging)]
    np.testing.assert_allclose(in_two[1][:2], in_two[0][:2], atol=2e-6)
    np.testing.assert_allclose(in_two[1][2:], in_two[0][2:], rtol=2e-3)


def moved_bench(settings: BenchSettings, direction: str, uneven: int) -> tuple[Array, Array]:
    """Lengths on the fields (T, 4) [m] in the middle of every millisecond, of `tendons_of` the plane, and the bend (T,)
    of a bench whose + side is reeled in as its - side is paid out, and back; one tendon by some steps more."""
    sides = tendons_of(DIRECTIONS[direction].plane)
    wrist = BenchWrist(settings, KNOWN)
    wrist.face(direction)
    wrist.hear(np.array([(0, ord("C"), 0)], EDGE))
    turns: list[tuple[int, int, bool]] = []
    for place, tendon in enumerate(sides):
        axis, back = ACTIVE.index(tendon), place >= 2
        more = uneven if place == 0 else 0
        turns += [(CYCLES * 2 * k + 100 * axis, axis, False) for k in range(30 + more)]
        turns += [(CYCLES * 700 + 4000 * k + 2000, axis, back) for k in range(400)]
        turns += [(CYCLES * 1000 + 4000 * k + 2000, axis, not back) for k in range(300)]
    turns.sort()
    for cycle, axis, back in turns:
        levels = (0b10 if back else 0) << 2 * axis
        wrist.hear(np.array([(cycle, ord("A"), level) for level in (levels, levels | 1 << 2 * axis, levels)], EDGE))
    wrist.follow(1400 * CYCLES)
    middle = CYCLES * np.arange(1400) + CYCLES // 2
    counts = np.zeros((1400, 4))
    for place, tendon in enumerate(sides):
        own = [(cycle, -1 if back else 1) for cycle, axis, back in turns if axis == ACTIVE.index(tendon)]
        counts[:, place] = [sum(way for cycle, way in own if cycle < until) for until in middle]
    return settings.actuator.step_length * counts, wrist.truth().angle


@pytest.mark.slow
@pytest.mark.parametrize("direction", ["ulnar", "flexion"])
def test_the_model_moves_as_the_emulated_rig_does_and_less_so_without_swing_or_bend_across(direction: str) -> None:
    settings = BenchSettings(motors=Motors(slack=(0.0,) * 4))
    reeled, truth = moved_bench(settings, direction, uneven=12)
    plane, own = DIRECTIONS[direction].plane, in_plane(KNOWN, direction)
    soft = own.model_copy(update={"stiffness": settings.plant.stiffness_scale * own.stiffness})
    motors = settings.actuator.model_copy(update={"tendon_stiffness": settings.stiffness_with_field})
    ulnar = settings.plant.stiffness_scale * KNOWN.stiffness
    whole = Supposed(
        soft, motors, rotors=SWINGING, across=across_plane(soft, plane, ulnar, KNOWN.flexion_ratio)
    )  # fmt: skip
    moved = slice(690, 1390)

    def off(supposed: Supposed) -> float:
        # a row of truth is the end of a millisecond, one of the model the begin of the next
        error = courses([supposed], reeled, STEP, settings.segments)[0, 1:, 0] - truth[:-1]
        return float(np.sqrt(np.mean(error[moved] ** 2)))

    assert np.ptp(truth) > 0.2
    assert off(whole) < 3e-5
    assert off(whole._replace(across=None)) > 3.0 * off(whole)
    assert off(whole._replace(rotors=Rotors(HOLDING))) > 3.0 * off(whole)


def test_a_rigs_own_rotors_are_known_where_nobody_says_what_they_are() -> None:
    motors = Motors(holding_torque=0.5, rotor_inertia=4e-5, spool_inertia=1e-6, damping=3e-3)
    assert rotors_of(with_rotors(IdentifySettings(), motors)) == pytest.approx((0.5, 4.1e-5, 3e-3))
    said = IdentifySettings(holding_torque=0.2)
    assert rotors_of(with_rotors(said, motors)) == Rotors(0.2, 0.0, said.rotor_damping)
    assert rotors_of(with_rotors(IdentifySettings(), Motors(rotor_inertia=0.0))) == Rotors()
