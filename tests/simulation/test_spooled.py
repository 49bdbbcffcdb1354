"""Wrists on spools that move as they are told: their bits, their energy, and winches that keep a pull."""

from __future__ import annotations

import numpy as np
import pytest

from tests.simulation import spools
from tests.simulation.spools import HOME, STIFF, WRIST, antagonists, minimum_jerk
from wristctl.simulation.spool_driven import Spooled, SpooledWrist, spooled
from wristctl.wrist.compiled_model import terms
from wristctl.wrist.segments import segments

STRAIGHT = np.zeros(4)
H = 1e-3


def follow(wrists: list[SpooledWrist], course: np.ndarray, every: int = 1) -> Spooled:
    """Move all of them by a course (T, 2), held over each step."""

    def told(time: np.ndarray, which: np.ndarray) -> np.ndarray:
        steps = np.rint(time / H - 0.5).astype(int)
        return np.repeat(course[steps][:, :, None], len(which), axis=2)

    return spooled(wrists, told, len(course), H, every)


def kinds() -> list[SpooledWrist]:
    """Wrists of several frictions, springs and beginnings."""
    tendons = [STIFF.model_copy(update={"friction": mu, "sheath": phi}) for mu in (0.1, 0.3) for phi in (0.0, 2.0)]
    soft = WRIST.model_copy(update={"stiffness": 0.5, "damping": 0.2})
    return [SpooledWrist(WRIST, each, STRAIGHT) for each in tendons] + [
        SpooledWrist(WRIST, STIFF.model_copy(update={"friction": 0.0}), STRAIGHT),
        SpooledWrist(WRIST, STIFF.model_copy(update={"tendon_stiffness": 5e3}), STRAIGHT),
        SpooledWrist(soft, STIFF, STRAIGHT, z=(1.0, -1.0)),
        SpooledWrist(WRIST, STIFF, np.full(4, 0.02)),
        SpooledWrist(soft, STIFF.model_copy(update={"presliding": 1e-4}), STRAIGHT),
    ]


def test_a_wrist_moves_alike_alone_and_among_others() -> None:
    course, wrists = antagonists(minimum_jerk(0.0, 5e-3, 0.3)), kinds()
    together = follow(wrists, course)
    for at, wrist in enumerate(wrists):
        alone = follow([wrist], course)
        assert all(one[0].tobytes() == many[at].tobytes() for one, many in zip(alone, together, strict=True))
    assert len({each.tobytes() for each in together.theta}) == len(wrists)


def test_it_moves_as_the_integration_step_moves_it() -> None:
    course = antagonists(minimum_jerk(0.0, 5e-3, 0.5))
    known = spools.spooled(course, STIFF)
    found = follow([SpooledWrist(WRIST, STIFF, STRAIGHT)], course)
    np.testing.assert_array_equal(found.theta[0], known.theta)
    np.testing.assert_array_equal(found.z[0, :, 0], known.z_plus)
    middle = 0.5 * (course[1:, 0] + course[:-1, 0])
    np.testing.assert_allclose(found.given[0, 1:, 0], middle, rtol=1e-15)
    steps = np.abs(known.spool_plus[1:] - found.spool[0, 1:, 0])
    assert steps.max() < 40e3 * np.abs(np.diff(course[:, 0])).max(), (
        "at a sample, between what is held before and after"
    )


def test_samples_are_every_so_many_steps_whatever_chunks_they_are_made_in() -> None:
    course, wrist = antagonists(np.tile(minimum_jerk(0.0, 2e-3, 0.7), 60)), SpooledWrist(WRIST, STIFF, STRAIGHT)
    assert len(course) > 40_000
    all_, some = follow([wrist], course), follow([wrist], course, 7)
    for fine, coarse in zip(all_, some, strict=True):
        np.testing.assert_array_equal(fine[:, ::7], coarse)


@pytest.mark.parametrize("n", [1, 4])
def test_what_spools_give_is_what_friction_and_damping_take_and_what_is_stored(n: int) -> None:
    """From rest to rest: springs, gravity and the hand's height by the model of its own."""
    path = np.concatenate([minimum_jerk(0.0, 6e-3, 2.0), np.full(1500, 6e-3)])
    done = follow([SpooledWrist(WRIST, STIFF, np.zeros(n))], antagonists(path))
    theta = fall(done.theta[0, -1], n)
    tip = terms(segments(WRIST, n), theta, 0.0 * theta).tip
    hand = np.array([tip[0] + WRIST.hand_offset * np.cos(tip[2])])
    chords = [np.cos(np.cumsum(theta)[k] - 0.5 * theta[k]) for k in range(n)]
    reach = np.concatenate([[0.0], np.cumsum(WRIST.length / n * np.array(chords))])
    masses = WRIST.mass / n * 0.5 * (reach[1:] + reach[:-1])
    straight = WRIST.hand_mass * (WRIST.length + WRIST.hand_offset) + WRIST.mass * WRIST.length / 2.0
    height = WRIST.hand_mass * hand[0] + masses.sum() - straight
    stored = 0.5 * WRIST.stiffness * n * float(theta @ theta) + 9.81 * height
    given, friction, damped = done.raw[0, -1], done.friction[0, -1], done.damped[0, -1]
    assert friction > 0.01 * given and damped > 0.01 * given
    assert given - friction - damped == pytest.approx(stored, abs=0.01 * given)


def fall(bend: float, n: int) -> np.ndarray:
    """Segments' angles of a wrist that is bent so by its tendons: nearly equal."""
    return np.full(n, bend / n)


def test_a_winch_keeps_its_pull() -> None:
    pulls = np.stack([minimum_jerk(4.0, 30.0, 0.4), np.full(400, 4.0)], axis=1)
    wrists = [SpooledWrist(WRIST, STIFF, STRAIGHT, winch=True), SpooledWrist(WRIST, STIFF, STRAIGHT)]
    done = follow(wrists[:1], pulls)
    middle = 0.5 * (pulls[1:] + pulls[:-1])
    np.testing.assert_allclose(done.spool[0, 1:, 0], middle[:, 0], atol=1e-3)
    np.testing.assert_allclose(done.spool[0, 1:, 1], 4.0, atol=1e-3)
    slipping = slice(300, 400)
    phi = STIFF.sheath + np.abs(done.theta[0])
    np.testing.assert_allclose(
        (done.spool[..., 0] / done.wrist[..., 0])[0, slipping], np.exp(0.1 * phi)[slipping], rtol=2e-4
    )
    assert done.theta[0, -1] > np.radians(15.0)


def test_bristles_begin_as_they_are_told() -> None:
    rest = np.full((3, 2), HOME)
    done = follow([SpooledWrist(WRIST, STIFF, STRAIGHT, z=(0.5, -0.25))], rest)
    assert (done.z[0, 0, 0], done.z[0, 0, 1]) == (0.5, -0.25)
    assert done.wrist[0, 0, 0] == pytest.approx(done.spool[0, 0, 0] * np.exp(-0.1 * 0.5))
