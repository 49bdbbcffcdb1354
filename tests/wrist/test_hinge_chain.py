"""The exported chain: MuJoCo moves it as our plant moves, and MATLAB's equations are those that MuJoCo integrates."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import wristctl
from wristctl.arrays import Array
from wristctl.config.wrist import TendonPlace, WristParameters
from wristctl.simulation.trajectory import Trajectory
from wristctl.simulation.worlds import plant_of
from wristctl.wrist.hinge_chain import HingeChain, Spools, matlab, mjcf

mujoco = pytest.importorskip("mujoco", reason="the extra `dev` has it")
WRIST = WristParameters()
TENDONS = (
    TendonPlace(angle_deg=20.0),
    TendonPlace(angle_deg=120.0, radius=0.015, ends_at=3),
    TendonPlace(angle_deg=220.0, multiplicity=2),
    TendonPlace(angle_deg=290.0, radius=0.01),
)


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


IN_SPACE = WRIST.model_copy(
    update={
        "tendons": TENDONS, "flexion_ratio": 1.6, "stiffness_axis_deg": 30.0, "gravity_flexion": 4.0, "taper": 3.0,
    }
)  # fmt: skip


@pytest.mark.skipif(shutil.which("octave") is None, reason="needs Octave")
@pytest.mark.parametrize(
    "chain",
    [
        *(HingeChain.of(WRIST, n) for n in (1, 2, 4)),
        *(HingeChain.of(IN_SPACE, n, planes=2) for n in (2, 4)),
        HingeChain.of(IN_SPACE, 4, planes=2, model="hinges"),
    ],
    ids=["1", "2", "4", "2 in space", "4 in space", "rigid links in space"],
)
def test_octave_finds_mujocos_accelerations_tips_and_bends(chain: HingeChain, tmp_path: Path) -> None:
    (tmp_path / "wrist_chain.m").write_text(matlab(chain, "a test"))
    n, planes, places = chain.segments, chain.planes, len(chain.tendons)
    rng, size = np.random.default_rng(n), n * planes
    ends = ((-0.8 / n, 0.8 / n, size), (-2.0 / n, 2.0 / n, size), (2.0, 60.0, places))
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
    alike = np.repeat(np.eye(n), chain.alike, axis=0) / chain.alike
    listed = np.kron(alike, np.eye(planes))  # joint by joint; MuJoCo has them in the order of the joints' hinges
    rows = [planes * (k - 1) + p for k in range(1, chain.links + 1) for p in chain.order(k)]
    data, spread = mujoco.MjData(model), listed[rows]
    for (q, rate, tension), row in zip(states, found, strict=True):
        data.qpos[:], data.qvel[:], data.ctrl[:] = spread @ q, spread @ rate, tension
        mujoco.mj_forward(model, data)
        inertia = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, inertia)
        force = data.qfrc_smooth
        expected = np.linalg.solve(spread.T @ inertia @ spread, spread.T @ force)
        np.testing.assert_allclose(row[:size], expected, rtol=1e-5, atol=1e-6 * max(1.0, np.abs(expected).max()))
        np.testing.assert_allclose(row[size:-planes], data.sensor("tip").data[: planes + 1], atol=1e-12)
        bend = q.sum() if planes == 1 else bends_of(data.sensor("direction").data)
        np.testing.assert_allclose(row[-planes:], bend, atol=1e-12)


def bends_of(direction: Array) -> Array:
    """Bends (..., 2) [rad] of a last link with these directions (..., 3)."""
    size = np.arctan2(np.hypot(direction[..., 1], direction[..., 2]), direction[..., 0])
    bend: Array = direction[..., 1:] / np.sinc(size / np.pi)[..., None]
    return bend


DRAWN = (
    "[{angle_deg: 11, radius: 0.018}, {angle_deg: 131, radius: 0.024}, {angle_deg: 215, multiplicity: 2}, "
    "{angle_deg: 288, ends_at: 4}]"
)
LAYOUTS = {
    "three": ("wrist.tendons=three", "wrist.length=0.095", "wrist.stiffness=1.1"),
    "four": ("wrist.tendons=four", "simulate.loop.planes=2"),
    "drawn": (f"wrist.tendons={DRAWN}",),
}
CIRCLE = (
    "simulate.reference={kind: circumduction, angle_deg: 25, duration: 2}", "simulate.controller=pid-ff",
    "simulate.gains=hardware", "simulate.horizon=4.0",
)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("layout", LAYOUTS)
def test_spools_that_simulate_recorded_bend_mujocos_wrist_as_ours_over_a_circle(layout: str) -> None:
    """Elastic tendons with friction behind motors and a camera; the lengths on the spools, nothing else, go over."""
    rig = ("simulate.loop.actuator.level=tendon", "simulate.loop.sensor.level=camera")
    study = wristctl.load_study(None, *LAYOUTS[layout], *CIRCLE, *rig)
    course = wristctl.simulate(study).trajectory
    chain = HingeChain.of(study.wrist, 4, planes=2)
    text = mjcf(chain, "a test", Spools.of(study.simulate.loop.actuator, study.wrist))
    model = mujoco.MjModel.from_xml_string(text)
    data, directions = mujoco.MjData(model), []
    steps = round((course.time[1] - course.time[0]) / model.opt.timestep)
    assert course.spools is not None
    for reeled in course.spools:
        mujoco.mj_forward(model, data)
        directions.append(data.sensor("direction").data.copy())
        data.ctrl[:] = reeled
        mujoco.mj_step(model, data, steps)
    bends, around = bends_of(np.array(directions)), course.time > 2.0
    off, size = np.abs(bends - course.theta)[around].max(axis=0), np.abs(course.theta)[around].max(axis=0)
    assert (size > np.deg2rad(24.0)).all() and (off < 0.01 * size).all()


OBLIQUE = (
    "wrist={flexion_ratio: 1.6, stiffness_axis_deg: 30, gravity: [-7.0, 3.0], gravity_flexion: 4.0}",
    "simulate.loop.planes=2",
)
RIGID = (*OBLIQUE, "simulate.loop.plant={model: hinges, taper: 3}")


@pytest.mark.slow
@pytest.mark.parametrize(
    "settings", [*LAYOUTS.values(), OBLIQUE, RIGID], ids=[*LAYOUTS, "oblique springs", "rigid links"]
)
def test_tensions_bend_mujocos_wrist_in_two_planes_as_ours(settings: tuple[str, ...]) -> None:
    """Without any loop around it what differs adds up."""
    study = wristctl.load_study(None, *settings, *CIRCLE)
    course, plant = wristctl.simulate(study).trajectory, study.simulate.loop.plant
    chain = HingeChain.of(plant_of(study.wrist, plant), 4, planes=2, model=plant.model)
    model = mujoco.MjModel.from_xml_string(mjcf(chain, "a test"))
    data, directions = mujoco.MjData(model), []
    for tension in course.tension:
        mujoco.mj_forward(model, data)
        directions.append(data.sensor("direction").data.copy())
        data.ctrl[:] = tension
        mujoco.mj_step(model, data)
    bends = bends_of(np.array(directions))
    assert np.ptp(course.theta, axis=0).min() > 0.7 and np.abs(bends - course.theta).max() < 5e-3
