"""The exported chain: MuJoCo moves it as our plant moves, and MATLAB's equations are those that MuJoCo integrates."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import wristctl
from wristctl.config.wrist import WristParameters
from wristctl.simulation.trajectory import Trajectory
from wristctl.wrist.hinge_chain import HingeChain, matlab, mjcf

mujoco = pytest.importorskip("mujoco", reason="the extra `dev` has it")
WRIST = WristParameters()


def moved(n: int) -> Trajectory:
    """The benchmark's move, 30 degrees in a second, on our own plant, and the tensions that did it."""
    loop = f"simulate.loop={{plant_segments: {n}}}"
    law = ("simulate.controller=pd-ff", "simulate.gains=default", "simulate.horizon=2.0")
    return wristctl.simulate(wristctl.load_study(None, loop, *law)).trajectory


@pytest.mark.parametrize(("n", "most"), [(1, 3e-3), (2, 5e-3), (4, 5e-3)])
def test_mujocos_chain_bends_as_our_plant_under_the_same_tensions(n: int, most: float) -> None:
    """Nothing closes the loop: what differs adds up. The bounds asked for were 3e-2 (n = 1) and 5e-3 (n = 4)."""
    course = moved(n)
    model = mujoco.MjModel.from_xml_string(mjcf(HingeChain.of(WRIST, n), "a test"))
    data, angles, tips = mujoco.MjData(model), [], []
    for tension in course.tension:
        mujoco.mj_forward(model, data)
        angles.append(data.qpos.sum())
        tips.append(data.sensor("tip").data[:2].copy())
        data.ctrl[:] = tension
        mujoco.mj_step(model, data)
    assert course.theta.max() > 0.5 and np.abs(np.array(angles) - course.theta).max() < most
    assert np.abs(np.array(tips) - course.tip).max() < 3e-4


@pytest.mark.parametrize("n", [1, 2, 3, 4, 8])
def test_tendons_are_as_long_as_the_plants(n: int) -> None:
    """Their change of length with the bend, which is what tensions act by; to third order in a segment's angle."""
    from wristctl.wrist.pcc import PCC

    model = mujoco.MjModel.from_xml_string(mjcf(HingeChain.of(WRIST, n), "a test"))
    data, alike = mujoco.MjData(model), model.nq // n
    straight = PCC.taut(WRIST, np.zeros(n))
    mujoco.mj_forward(model, data)
    own = data.ten_length.copy()
    for bend in (0.3, -0.5):
        angles = bend / n * np.linspace(0.8, 1.2, n)
        data.qpos[:] = np.repeat(angles / alike, alike)
        mujoco.mj_forward(model, data)
        shorter = PCC.taut(WRIST, angles) - straight
        np.testing.assert_allclose(data.ten_length - own, shorter, atol=1e-5)
        assert np.sign(shorter[1] - shorter[0]) == np.sign(bend)


def test_gravity_masses_and_limits_are_the_wrists() -> None:
    other = WRIST.model_copy(update={"hand_mass": 0.5, "gravity": (1.0, -9.0), "tension_limit": 33.0})
    model = mujoco.MjModel.from_xml_string(mjcf(HingeChain.of(other, 4), "a -- test"))
    assert model.opt.gravity.tolist() == [1.0, -9.0, 0.0] and model.body_mass.max() == 0.5
    np.testing.assert_allclose(model.actuator_ctrlrange, [[other.pretension, 33.0]] * 2)
    assert model.body_mass.sum() == pytest.approx(0.5 + 0.75 * other.mass)  # the first quarter sits at the first hinge


@pytest.mark.skipif(shutil.which("octave") is None, reason="needs Octave")
@pytest.mark.parametrize("n", [1, 2, 4])
def test_octave_finds_mujocos_accelerations_tips_and_angles(n: int, tmp_path: Path) -> None:
    chain = HingeChain.of(WRIST, n)
    (tmp_path / "wrist_chain.m").write_text(matlab(chain, "a test"))
    rng = np.random.default_rng(n)
    ends = ((-0.8 / n, 0.8 / n, n), (-2.0 / n, 2.0 / n, n), (2.0, 60.0, 2))
    states = [tuple(rng.uniform(*each) for each in ends) for _ in range(5)]
    calls = "".join(
        f"[a, t, b] = wrist_chain({q.tolist()}', {rate.tolist()}', {tension.tolist()}');"
        "printf('%.17g ', [a; t; b]); printf('\\n');"
        for q, rate, tension in states
    )
    done = subprocess.run(["octave", "--no-gui", "-qf", "--eval", calls], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = [np.array(line.split(), float) for line in done.stdout.splitlines()]
    model = mujoco.MjModel.from_xml_string(mjcf(chain, "a test"))
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_EQUALITY
    data, spread = mujoco.MjData(model), np.repeat(np.eye(n), chain.alike, axis=0) / chain.alike
    for (q, rate, tension), row in zip(states, found, strict=True):
        data.qpos[:], data.qvel[:], data.ctrl[:] = spread @ q, spread @ rate, tension
        mujoco.mj_forward(model, data)
        inertia = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, inertia)
        force = data.qfrc_smooth
        np.testing.assert_allclose(
            row[:n], np.linalg.solve(spread.T @ inertia @ spread, spread.T @ force), rtol=1e-5, atol=1e-6
        )
        np.testing.assert_allclose(row[n:-1], data.sensor("tip").data[:2], atol=1e-12)
        assert row[-1] == pytest.approx(q.sum(), abs=1e-12)
