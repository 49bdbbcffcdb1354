"""The forward model's angles: at rest first, mirrored with the spools, and each candidate its own."""

from __future__ import annotations

import numpy as np
import pytest

from tests.identification.benches import KNOWN, LEVEL, TENDONS, tendons
from wristctl.arrays import Array
from wristctl.identification.forward import SupposedWrist, angles
from wristctl.identification.spatial_forward import SupposedBends, courses_of_bends
from wristctl.wrist.statics import equilibrium
from wristctl.wrist.tendon_layout import TendonLayout

STIFF, STEP = 20e3, 1e-3


def held(plus: float, minus: float, steps: int = 200) -> Array:
    return np.tile([plus, plus, minus, minus], (steps, 1))


def test_a_wrist_is_at_rest_on_its_first_spool_positions() -> None:
    """Level, where gravity bends it: no angle moves while the spools stand."""
    soft = LEVEL.model_copy(update={"stiffness": 0.8})
    course = angles([SupposedWrist(soft, tendons(STIFF, 0.1))], held(2e-4, 2e-4), STEP, 4)[0]
    assert abs(course[0]) > 1e-3 and np.ptp(course) < 0.01 * abs(course[0])


def test_the_pull_is_what_a_tendon_is_stretched_by() -> None:
    """Without friction: k times what is reeled in more than the path is shorter by, and never a push."""
    plus, minus = 1.2e-3, 1e-4
    bent = angles([SupposedWrist(KNOWN, tendons(STIFF, 0.0))], held(plus, minus, 600), STEP, 4)[0, -1]
    arm = KNOWN.tendon_offset
    pulls = [max(0.0, STIFF * (reeled - sign * arm * bent)) for reeled, sign in ((plus, 1.0), (minus, -1.0))]
    assert bent == pytest.approx(equilibrium(KNOWN, 4, (pulls[0], pulls[1])).sum(), rel=0.02)
    assert 0.02 < bent < plus / arm


def test_mirrored_spools_bend_the_upright_wrist_the_other_way() -> None:
    swing = 1e-3 * np.sin(np.linspace(0.0, 3.0, 200))
    reeled = 3e-4 + np.stack([swing, swing, -swing, -swing], axis=1)
    candidate = SupposedWrist(KNOWN, tendons(STIFF, 0.1))
    one, other = (angles([candidate], each, STEP, 4)[0] for each in (reeled, reeled[:, [2, 3, 0, 1]]))
    assert np.abs(one).max() > 0.02
    np.testing.assert_allclose(other, -one, atol=1e-9)
    swapped = angles([candidate], reeled[:, [1, 0, 3, 2]], STEP, 4)[0]
    np.testing.assert_allclose(swapped, one, atol=1e-12, err_msg="tendons of a side are alike")


def test_each_candidate_is_as_it_would_be_alone_and_its_own_tautness_counts_as_reeled_in() -> None:
    reeled = held(6e-4, 2e-4)
    taut = (1e-4, -5e-5, 2e-4, 3e-5)
    candidates = [
        SupposedWrist(KNOWN, tendons(STIFF, 0.1)),
        SupposedWrist(LEVEL, tendons(5e3, 0.0)),
        SupposedWrist(KNOWN, tendons(STIFF, 0.1), taut),
    ]
    together = angles(candidates, reeled, STEP, 4)
    assert together.shape == (3, 200)
    for at, candidate in enumerate(candidates):
        np.testing.assert_allclose(together[at], angles([candidate], reeled, STEP, 4)[0], atol=1e-9)
    np.testing.assert_allclose(together[2], angles(candidates[:1], reeled + np.array(taut), STEP, 4)[0], atol=1e-9)


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
RIGID = SupposedBends(
    KNOWN, tendons(STIFF, 0.0), LAYOUT.cross_section, (0.0,) * 4, LAYOUT.shares(KNOWN.discs), LAYOUT.multiplicity
)


def test_a_rotor_gives_way_by_the_arc_sine_of_its_pull() -> None:
    reeled = np.tile([2.2e-3, 1.9e-3, 4e-4, 5e-4], (600, 1))
    yielding = courses_of_bends([RIGID._replace(holding=HOLDING)], reeled, STEP, 2)[0, -1]
    less = given_way(yielding[2:])
    assert less.max() > 2e-6
    without, with_less = (courses_of_bends([RIGID], each, STEP, 2)[0, -1] for each in (reeled, reeled - less))
    assert np.abs(with_less - yielding).max() < 0.05 * np.abs(without - yielding).max()


def test_in_one_plane_rotors_give_way_as_in_two() -> None:
    plus, minus = 2.2e-3, 4e-4
    both = np.tile([minus, minus, plus, plus], (600, 1))
    wrists = [RIGID, RIGID._replace(holding=HOLDING)]
    ulnar = [float(courses_of_bends([wrist], both, STEP, 2)[0, -1, 0]) for wrist in wrists]
    supposed = [SupposedWrist(KNOWN, tendons(STIFF, 0.0), holding=holding) for holding in (np.inf, HOLDING)]
    alone = [float(course[-1]) for course in angles(supposed, held(plus, minus, 600), STEP, 2)]
    assert ulnar[0] - ulnar[1] > 1e-5
    assert alone[0] - alone[1] == pytest.approx(ulnar[0] - ulnar[1], rel=0.05)
