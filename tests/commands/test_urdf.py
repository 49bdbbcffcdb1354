"""The URDF: MuJoCo, which reads it, has its tip where our chain of rigid links has it."""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from wristctl.commands.export.urdf import joint_angles, urdf
from wristctl.config.wrist import WristParameters
from wristctl.wrist.hinge_chain import HingeChain, mjcf
from wristctl.wrist.hinges import HINGES
from wristctl.wrist.spatial.hinges_in_space import HINGES_IN_SPACE

mujoco = pytest.importorskip("mujoco", reason="the extra `dev` has it")
WRIST = WristParameters()
BENDS = np.array([[0.0, 0.0], [0.5, 0.0], [0.0, -0.7], [0.4, 0.6], [-0.9, 0.3], [1.0, -1.0]])


def read(text: str) -> tuple[Any, Any]:
    """What MuJoCo makes of a URDF, without merging links that do not move against each other."""
    kept = text.replace(
        '<robot name="wrist">', '<robot name="wrist"><mujoco><compiler fusestatic="false"/></mujoco>', 1
    )
    model = mujoco.MjModel.from_xml_string(kept)
    return model, mujoco.MjData(model)


@pytest.mark.parametrize(("n", "wrist"), [(4, WRIST), (3, WRIST.model_copy(update={"stiffness_axis_deg": 30.0}))])
def test_its_tip_is_that_of_our_rigid_links_for_any_bend(n: int, wrist: WristParameters) -> None:
    chain = HingeChain.of(wrist, n, 2, "hinges")
    model, data = read(urdf(chain, wrist.range_deg, "a test"))
    angles = joint_angles(chain, BENDS)
    assert model.njnt == len(angles) == 2 * n
    for row, bend in enumerate(BENDS):
        for name, values in angles.items():
            data.joint(name).qpos[:] = values[row]
        mujoco.mj_forward(model, data)
        ours = HINGES_IN_SPACE.tips(wrist, np.tile(bend / n, n))
        np.testing.assert_allclose(data.body("wrist_tip").xpos, ours, atol=1e-6)
        tangent = data.body("wrist_tip").xmat.reshape(3, 3)[:, 0]
        size = np.linalg.norm(bend)
        np.testing.assert_allclose(tangent, [np.cos(size), *(np.sinc(size / np.pi) * bend)], atol=1e-9)
        if size <= np.radians(wrist.range_deg):
            assert np.abs(model.jnt_range).min() > np.abs([values[row] for values in angles.values()]).max()


def test_in_one_plane_it_is_the_planar_chain_and_joints_that_bend_alike_mimic() -> None:
    chain = HingeChain.of(WRIST, 4, 1, "hinges")
    model, data = read(urdf(chain, WRIST.range_deg, "a test"))
    data.qpos[:] = [0.1, 0.2, -0.3, 0.4]
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.body("wrist_tip").xpos[:2], HINGES.tips(WRIST, np.array(data.qpos)), atol=1e-9)
    root = ElementTree.fromstring(urdf(HingeChain.of(WRIST, 2, 2), WRIST.range_deg, "a test"))
    free = [joint.get("name") for joint in root.iter("joint") if joint.find("mimic") is None]
    assert free == ["hinge1y", "hinge1z", "hinge3y", "hinge3z", "tip"]
    copies = {
        joint.get("name"): mimic.get("joint")
        for joint in root.iter("joint")
        if (mimic := joint.find("mimic")) is not None
    }
    assert copies == {"hinge2y": "hinge1y", "hinge2z": "hinge1z", "hinge4y": "hinge3y", "hinge4z": "hinge3z"}


def test_links_and_joints_are_those_of_the_model_for_mujoco() -> None:
    chain = HingeChain.of(WRIST, 4, 2)
    model, data = read(urdf(chain, WRIST.range_deg, "a test"))
    other = mujoco.MjModel.from_xml_string(mjcf(chain, "a test"))
    moved = mujoco.MjData(other)
    for k in range(other.njnt):
        name, angle = other.joint(k).name, 0.1 * np.cos(k)
        data.joint(name).qpos[:] = moved.joint(name).qpos[:] = angle
    mujoco.mj_forward(model, data)
    mujoco.mj_forward(other, moved)
    np.testing.assert_allclose(data.body("wrist_tip").xpos, moved.sensor("tip").data, atol=1e-12)
    shapes = [
        shape.tag for geometry in ElementTree.fromstring(urdf(chain, 60.0, "")).iter("geometry") for shape in geometry
    ]
    assert shapes.count("cylinder") == 10 and shapes.count("sphere") == 1
