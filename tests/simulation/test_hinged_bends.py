"""Loops in two planes whose wrist is of rigid links, which their controllers do not believe."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from wristctl.arrays import Array
from wristctl.config.loop import Loop
from wristctl.config.wrist import TendonPlace, WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.errors import UserError
from wristctl.plotting.spatial_view import motion_in_space
from wristctl.simulation.closed_loop import follow
from wristctl.simulation.motion import Angles, Motion
from wristctl.simulation.repetitions import Simulation
from wristctl.simulation.rollout import rollout
from wristctl.simulation.spatial_references import bend_path
from wristctl.wrist.plant import PLANTS, PLANTS_IN_SPACE

LAW = controller("pid-ff")
GAINS = np.array(gains_of(LAW, "default"))
WRIST = WristParameters()


def looped(model: str = "hinges", segments: int = 4, **loop: Any) -> Loop:
    plant = {"model": model} | loop.pop("plant", {})
    return Loop.model_validate({"coupling": "ignored", "plant": plant, "plant_segments": segments, **loop})


def followed(path: Array, loop: Loop, wrist: WristParameters = WRIST, force: Array | None = None) -> Simulation:
    return follow(LAW, GAINS, Motion.of_bends(path, 1e-3, wrist.length), wrist, loop, force)


@pytest.mark.slow
@pytest.mark.parametrize("side", [0, 1])
def test_a_bend_in_one_plane_is_the_loop_of_planar_hinges(side: int) -> None:
    line = bend_path("dart-thrower", 35.0, 1.0, 1.0, toward_deg=-40.0)[0]
    path = np.zeros((2, *line.shape))
    path[side] = line
    course = followed(path, looped(plant={"taper": 2.0}, control_period=1e-3, substeps=1)).trajectory
    time = course.time
    motion = Motion(time, Angles.of(line), np.zeros((len(time), 2)), None, 0.0, time[-1], time[-1])
    loop = looped(plant={"taper": 2.0}, control_period=1e-3, substeps=1)
    planar = rollout(LAW, GAINS[None], [motion], np.zeros(1, np.int64), loop, WRIST, record=True)
    assert course.bend[:, side] == pytest.approx(planar.column("theta", 0), abs=1e-9)
    assert course.torque_wanted[:, side] == pytest.approx(planar.column("torque_wanted", 0), abs=1e-7)
    assert abs(course.bend[:, 1 - side]).max() < 1e-12


@pytest.mark.slow
def test_it_is_followed_behind_motors_tendons_and_a_camera_as_another_plant_than_arcs() -> None:
    path = bend_path("circumduction", 20.0, 1.5, 1.5)
    rig: dict[str, Any] = {"actuator": {"level": "tendon"}, "sensor": {"level": "camera"}}
    arcs, links, stiffer = (
        followed(path, looped(model, 4, plant=plant, **rig), force=np.array([0.0, 0.3, -0.2]))
        for model, plant in (("pcc", {}), ("hinges", {}), ("hinges", {"taper": 3.0}))
    )
    for done in (arcs, links, stiffer):
        assert not done.failed and done.metrics["rmse"] < np.deg2rad(1.0)
    for done in (links, stiffer):
        assert np.ptp(done.trajectory.bend - arcs.trajectory.bend, axis=0).min() > 1e-5
    even, uneven = (np.hypot(*done.trajectory.segment_theta[-1].reshape(4, 2).T) for done in (links, stiffer))
    assert uneven[0] / uneven[-1] < 0.5 * even[0] / even[-1]


@pytest.mark.slow
def test_the_tip_is_where_the_links_end_and_the_picture_draws_them_straight() -> None:
    course = followed(bend_path("dart-thrower", 30.0, 0.5, 0.5), looped(segments=1)).trajectory
    largest = int(np.argmax(np.hypot(*course.bend.T)))
    bend, half = course.segment_theta[largest], 0.5 * WRIST.length
    size = np.hypot(*bend)
    across = np.sin(size) * bend / size
    np.testing.assert_allclose(course.tip[largest], half * np.array([1.0 + np.cos(size), *across]), atol=1e-12)
    centres, axes = PLANTS_IN_SPACE["hinges"].frames(WRIST, bend, np.array([0.25, 0.5, 1.0]))
    np.testing.assert_allclose(centres, [[0.5 * half, 0.0, 0.0], [half, 0.0, 0.0], course.tip[largest]], atol=1e-12)
    np.testing.assert_allclose(axes[[0, 2], :, 0], [[1.0, 0.0, 0.0], [np.cos(size), *across]], atol=1e-12)
    drawn = motion_in_space(course, WRIST, plant="hinges")
    backbone = [np.asarray(line.get_xydata()) for line in drawn.axes[0].lines if line.get_linewidth() == 2.0]
    assert len(backbone) == WRIST.discs - 1
    for line in backbone:
        np.testing.assert_allclose(line, np.linspace(line[0], line[-1], len(line)), atol=1e-9)


def test_what_no_wrist_of_links_or_of_arcs_can_be_is_said() -> None:
    path = bend_path("circle", 10.0, 1.0, 1.0)
    inner = TendonPlace(angle_deg=60.0, radius=0.01, ends_at=3)
    corners = [TendonPlace(angle_deg=angle) for angle in (45.0, 135.0, 225.0, 315.0)]
    with pytest.raises(UserError, match="within one of 3 segments"):
        followed(path, looped(segments=3), WRIST.model_copy(update={"tendons": (*corners, inner)}))
    with pytest.raises(UserError, match="equally stiff"):
        followed(path, looped("pcc", plant={"taper": 2.0}))


def test_a_plant_of_one_plane_alone_is_refused_in_two(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(PLANTS, "rod", PLANTS["hinges"])
    with pytest.raises(UserError, match="unknown plant in two planes 'rod'"):
        followed(bend_path("circle", 10.0, 1.0, 1.0), looped("rod"))
