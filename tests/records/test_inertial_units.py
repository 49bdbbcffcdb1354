"""Bends of a log by an inertial unit: the orientation's, or gravity's, however the unit sits; and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from wristctl.arrays import Array
from wristctl.errors import UserError
from wristctl.records.open_log import OpenLog, read_table

TIME = np.arange(0.0, 4.0, 0.05)
BENDS = 0.5 * np.stack([np.sin(1.5 * TIME), np.sin(2.3 * TIME) * np.minimum(1.0, TIME)], axis=1)


def turned(bends: Array) -> Rotation:
    """Orientation of the last disc, x along the wrist, bent toward y and z without a twist."""
    return Rotation.from_rotvec(np.stack([0.0 * bends[:, 0], -bends[:, 1], bends[:, 0]], axis=1))


def written(folder: Path, head: str, columns: Array) -> Path:
    file = folder / "unit.csv"
    np.savetxt(file, columns, "%.9g", ",", header=head, comments="")
    return file


def quaternions(folder: Path, axes: Rotation) -> Path:
    """A unit whose axes are others than the wrist's by a rotation, in a laboratory turned at random."""
    turns = Rotation.random(random_state=3) * turned(BENDS) * axes
    return written(folder, "time [s],quat_x,quat_y,quat_z,quat_w", np.column_stack([TIME, turns.as_quat()]))


def bends_of(log: OpenLog) -> Array:
    bends = log.bends()
    assert bends is not None
    return bends


def test_a_unit_along_the_wrist_tells_both_bends(tmp_path: Path) -> None:
    log = read_table(quaternions(tmp_path, Rotation.identity()))
    assert bends_of(log) == pytest.approx(BENDS, abs=1e-6)
    assert any("inertial unit's orientation" in remark and "unit.csv:2" in remark for remark in log.remarks)


def test_another_axis_along_the_wrist_is_asked_for_and_named(tmp_path: Path) -> None:
    axes = Rotation.from_matrix(np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]))  # its z is the wrist's x
    file = quaternions(tmp_path, axes)
    assert bends_of(read_table(file, "along=z, toward=x")) == pytest.approx(BENDS, abs=1e-6)
    whole = np.stack([0.5 * np.sin(1.5 * TIME), 0.02 * np.sin(2.3 * TIME)], axis=1)
    turns = (turned(whole) * Rotation.from_euler("y", 90.0, degrees=True)).as_quat()
    wrong = written(tmp_path, "time [s],quat_x,quat_y,quat_z,quat_w", np.column_stack([TIME, turns]))
    with pytest.raises(UserError, match="turns about its x") as caught:
        read_table(wrong)
    assert "along=" in str(caught.value)


def test_the_noise_of_the_first_row_turns_no_bend_aside(tmp_path: Path) -> None:
    twisted = turned(BENDS)
    first = Rotation.from_rotvec([0.05, 0.0, 0.0])
    turns = Rotation.concatenate([twisted[:1] * first, twisted[1:]])
    file = written(tmp_path, "time [s],quat_x,quat_y,quat_z,quat_w", np.column_stack([TIME, turns.as_quat()]))
    assert bends_of(read_table(file))[1:] == pytest.approx(BENDS[1:], abs=2e-3)


@pytest.mark.parametrize("down", [(-1.0, 0.0, 0.0), (1.0, 0.0, 0.0), (-0.8, 0.6, 0.0), (0.7, 0.1, -0.7)])
def test_gravity_tells_both_bends_of_a_wrist_that_stands_or_hangs(
    tmp_path: Path, down: tuple[float, float, float]
) -> None:
    gravity = turned(BENDS).inv().apply(9.81 * np.array(down) / np.linalg.norm(down))
    still = np.repeat(gravity[:1], 5, axis=0)
    time = 0.05 * np.arange(len(gravity) + 5.0)
    file = written(
        tmp_path, "time [s],gravity_x,gravity_y,gravity_z", np.column_stack([time, np.concatenate([still, gravity])])
    )
    assert bends_of(read_table(file))[5:] == pytest.approx(BENDS, abs=1e-6)


def test_gravity_across_the_wrist_and_broken_quaternions_are_refused(tmp_path: Path) -> None:
    gravity = turned(BENDS).inv().apply([0.0, 0.0, -9.81])
    file = written(tmp_path, "time [s],gravity_x,gravity_y,gravity_z", np.column_stack([TIME, gravity]))
    with pytest.raises(UserError, match="across the straight wrist") as caught:
        read_table(file)
    assert "quaternions" in str(caught.value)
    turns = 0.5 * turned(BENDS).as_quat()
    file = written(tmp_path, "time [s],quat_x,quat_y,quat_z,quat_w", np.column_stack([TIME, turns]))
    with pytest.raises(UserError, match=r"norm is 0\.5"):
        read_table(file)


def test_an_accelerometer_in_quick_motion_is_said(tmp_path: Path) -> None:
    gravity = turned(BENDS).inv().apply([-9.81, 0.0, 0.0]) * (1.0 + 0.2 * np.sin(40.0 * TIME))[:, None]
    file = written(tmp_path, "time [s],acc_x [g],acc_y [g],acc_z [g]", np.column_stack([TIME, gravity / 9.80665]))
    names = "time=time, gravity_x=acc_x, gravity_y=acc_y, gravity_z=acc_z"
    log = read_table(file, names)
    assert any("shake an accelerometer" in remark for remark in log.remarks)
    assert float(np.ptp(bends_of(log), axis=0).min()) > 0.8


@pytest.mark.parametrize(
    ("heads", "proposed"),
    [
        ("t,I1 (mA),I2 (mA),imu_qw,imu_qx,imu_qy,imu_qz", ["current_1=I1 (mA) [mA]", "quat_w=imu_qw", "quat_z=imu_qz"]),
        ("zeit_ms,Strom1,Strom2,Winkel", ["current_1=Strom1 [A]", "current_2=Strom2 [A]", "bend_y=Winkel [rad]"]),
        ("t,motor1_current_mA,motor2_current_mA,theta_deg", ["current_1=motor1_current_mA [mA]", "current_2="]),
        ("t,F1_N,F2_N,theta_deg,theta_rate_y (deg/s)", ["tension_1=F1_N [N]", "rate_y=theta_rate_y (deg/s) [deg/s]"]),
        ("t,I1_cmd (A),I2_cmd (A),angle_deg", ["current_1=I1_cmd (A) [A]", "current_2=I2_cmd (A) [A]"]),
        ("t,I1 (A),I2 (A),I1_cmd (A),I2_cmd (A),angle_deg", ["current_1=I1 (A) [A]", "current_2=I2 (A) [A]"]),
        ("t,I1 (A),I2 (A),acc_x,acc_y,acc_z", ["gravity_x=acc_x", "gravity_z=acc_z"]),
    ],
)
def test_columns_of_currents_and_inertial_units_are_known_by_name_and_unit(
    tmp_path: Path, heads: str, proposed: list[str]
) -> None:
    cells = np.column_stack([TIME] + [0.1 * (k + 1) * np.sin(TIME) for k in range(heads.count(","))])
    file = written(tmp_path, heads, cells)
    with pytest.raises(UserError) as caught:
        read_table(file)
    for entry in proposed:
        assert entry in str(caught.value)
