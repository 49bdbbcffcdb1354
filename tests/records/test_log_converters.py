"""Files of real robots: small ones of our own, in their authors' formats."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
from openpyxl import Workbook
from scipy.io import savemat
from scipy.spatial.transform import Rotation

from wristctl.errors import UserError
from wristctl.records.log_converters import ARM_STEP, read_log, spirob_log
from wristctl.records.workbooks import read_sheets

NECK_OPEN = (
    "time,target_motor1,encoder1,target_motor2,encoder2,target_motor3,encoder3,inclination_target,inclination_sensor,"
    "orientation_target,orientation_sensor,ep1,kinematics_inclination,kinematics_orientation"
)
NECK_CLOSED = (
    "time,inclination_target,inclination_sensor,orientation_target,orientation_sensor,inclination_error,"
    "control_signal_m1,control_signal_m2,control_signal_m3,encoder1,encoder2,encoder3,kinematics_inclination"
)


def put(folder: Path, name: str, *lines: str) -> Path:
    file = folder / name
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return file


def test_the_soft_necks_winches_are_in_degrees_in_open_loop_and_in_radians_in_closed_loop(tmp_path: Path) -> None:
    still = put(tmp_path, "spring_test_500gr.csv", NECK_OPEN, "0.01,1,180,2,-90,3,90,15,10,20,90,0,0,0")
    log = read_log(still, "humasoft")
    np.testing.assert_allclose(
        [log.columns[f"spool_{k}"][0] for k in (1, 2, 3)], 0.01 * np.pi * np.array([1, -0.5, 0.5])
    )
    bends = log.bends()
    assert bends is not None and log.columns["mass"].tolist() == [0.5]
    np.testing.assert_allclose(bends, [[0.0, np.radians(10.0)]], atol=1e-12)
    closed = put(tmp_path, "a__imu_closeloop__frontier_test_1000gr.csv", NECK_CLOSED, "0,15,1,0,0,1,1,1,1,2.0,-1,0.5,0")
    again = read_log(closed, "humasoft")
    np.testing.assert_allclose([again.columns[f"spool_{k}"][0] for k in (1, 2, 3)], [0.02, -0.01, 0.005])
    assert again.words["trial"].tolist() == ["frontier_test_1000gr"] and again.columns["mass"].tolist() == [1.0]
    heads = "time,target_inclination,sensor_inclination,target_orientation,sensor_orientation"
    steps = put(tmp_path, "00-step.csv", heads, "0,15,0.5,90,0")
    assert list(read_log(steps, "humasoft").columns) == ["time", "inclination", "orientation"]
    with pytest.raises(UserError, match="no inclination of a soft neck"):
        read_log(put(tmp_path, "mocap.csv", "timestamp,Mocap-roll", "0,1"), "humasoft")


def test_opencrs_tendons_come_in_the_order_of_their_columns_and_its_rod_along_x(tmp_path: Path) -> None:
    servos = ",".join(f"servo_{k}_mm" for k in (4, 3, 9, 5, 2, 8, 6, 1, 7))
    rows = ["10.5,pull,1,2,3,4,5,6,7,8,9,-2,8,188", "11.0,bend,0,0,0,0,0,0,0,0,0,-3,9,187"]
    log = read_log(put(tmp_path, "val.csv", f"timestamp,pattern_label,{servos},tip_x,tip_y,tip_z", *rows), "opencr")
    assert [float(column[0]) for column in log.tendons("spool").values()] == pytest.approx(
        [1e-3 * k for k in range(1, 10)]
    )
    assert {name: pytest.approx(float(log.columns[name][0])) for name in ("tip_x", "tip_y", "tip_z")} == {
        "tip_x": 0.188, "tip_y": -0.002, "tip_z": 0.008,
    }  # fmt: skip
    assert list(log.trials()) == ["pull", "bend"]
    with pytest.raises(UserError, match="1 columns servo_<id>_mm"):
        read_log(put(tmp_path, "one.csv", "timestamp,pattern_label,servo_1_mm", "1,a,1"), "opencr")


def test_the_silicone_arm_is_read_from_text_and_from_matlab_alike(tmp_path: Path) -> None:
    rows = np.array([[0.0, 0, 0, 1.0, 2.0, -90.0], [100, -50, 20, 5.0, -4.0, -88.0]])
    text = read_log(put(tmp_path, "log.txt", *(", ".join(map(str, row)) for row in rows)), "deepc-arm")
    savemat(tmp_path / "log.mat", {"ud": rows[:, :3].T, "yd": rows[:, 3:].T})
    matlab = read_log(tmp_path / "log.mat", "deepc-arm")
    for name, column in text.columns.items():
        np.testing.assert_allclose(matlab.columns[name], column)
    assert text.columns["time"].tolist() == [0.0, 0.25] and text.columns["spool_2"][1] == pytest.approx(-50 * ARM_STEP)
    tip = [text.columns[f"tip_{axis}"][1] for axis in "xyz"]
    np.testing.assert_allclose(tip, [0.088, 0.005, 0.004])
    with pytest.raises(UserError, match=r"'1 2 three' is no sample of the arm - .*log\.txt:2"):
        read_log(put(tmp_path, "log.txt", "1 2 3 4 5 6", "1, 2, three"), "deepc-arm")
    savemat(tmp_path / "loops.mat", {"yex21": rows[:, 3:].T, "yex22": 2.0 * rows[:, 3:].T})
    closed = read_log(tmp_path / "loops.mat", "deepc-arm")
    assert list(closed.trials()) == ["yex21", "yex22"]
    for name in ("tip_x", "tip_y", "tip_z"):
        np.testing.assert_array_equal(
            closed.columns[name], np.concatenate([matlab.columns[name], 2.0 * matlab.columns[name]])
        )


def workbook(file: Path, sheets: Mapping[str, Sequence[Sequence[str | float]]]) -> Path:
    """An Excel workbook."""
    book = Workbook()
    book.remove(book.worksheets[0])
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append([None if cell == "" else cell for cell in row])
    book.save(file)
    return file


PROBE = ["", "Motor position", "Current", *(f"Tip position {axis}" for axis in "xyz"),
         *(f"Tip orientation {axis}" for axis in "xyzw"), *(f"Base position {axis}" for axis in "xyz"),
         *(f"Base orientation {axis}" for axis in "xyzw")]  # fmt: skip


def test_the_probes_bend_is_its_turn_in_the_base_whichever_way_that_stands(tmp_path: Path) -> None:
    steps = np.concatenate([np.linspace(1600, 2400, 41), np.linspace(2400, 800, 81), np.linspace(800, 1600, 41)])
    bend = np.radians(0.05 * (steps - 1600.0))
    axis = np.array([0.48, -0.6, 0.64])
    trembling = 1e-3 * np.sin(np.outer(np.arange(163.0), [1.0, 0.7, 0.3]))
    base = Rotation.from_euler("xyz", [0.3, -1.1, 2.0]) * Rotation.from_rotvec(trembling)
    tip = base * Rotation.from_rotvec(bend[:, None] * axis) * Rotation.from_euler("x", 0.7)
    rows = [
        [float(k), float(s), 0.1, 1.0, 2.0, 3.0, *map(float, t), 0.0, 0.0, 0.0, *map(float, b)]
        for k, (s, t, b) in enumerate(zip(steps, tip.as_quat(), base.as_quat(), strict=True))
    ]
    file = workbook(
        tmp_path / "motor1.xlsx", {"First": [PROBE, *rows], "Notes": [["nothing"]], "Second": [PROBE, *rows[::-1]]}
    )
    log = read_log(file, "tee-probe")
    first, second = log.trials().values()
    assert list(log.trials()) == ["First", "Second"] and first.at(0).endswith("motor1.xlsx:2")
    np.testing.assert_allclose(first.columns["bend_y"], bend, atol=2e-3)
    np.testing.assert_allclose(second.columns["bend_y"], bend[::-1], atol=2e-3)
    np.testing.assert_allclose(first.columns["spool_1"], 0.01 * np.radians(0.05 * (steps - 1600.0)), rtol=2e-3)
    np.testing.assert_allclose(first.columns["spool_2"], -first.columns["spool_1"])
    lost = [4.0, 1700.0, 0.1, 1.0, 2.0, 3.0, *[0.0] * 4, 0.0, 0.0, 0.0, *map(float, base.as_quat()[0])]
    measured: list[Sequence[str | float]] = [*rows, lost, [5.0, 1700.0, "-", "lost"]]
    other = [re.sub(r"[ _](.)", lambda letter: letter[1].upper(), head) for head in PROBE]
    other[1] = "MotorPosition [steps]"
    for heads in (PROBE, other):
        sheets: dict[str, Sequence[Sequence[str | float]]] = {
            "First": [heads, *measured],
            "Empty": [heads],
            "Still": [heads, rows[0]],
        }
        again = read_log(workbook(tmp_path / "lost.xlsx", sheets), "tee-probe")
        assert list(again.trials()) == ["First"]
        np.testing.assert_array_equal(again.columns["bend_y"], first.columns["bend_y"])
    with pytest.raises(UserError, match="no sheet has a motor position"):
        read_log(workbook(tmp_path / "other.xlsx", {"A": [["x", "y"], [1.0, 2.0]]}), "tee-probe")
    (tmp_path / "text.xlsx").write_text("no zip")
    with pytest.raises(UserError, match="no Excel workbook"):
        read_log(tmp_path / "text.xlsx", "tee-probe")


def test_rows_of_a_sheet_are_as_long_as_its_longest(tmp_path: Path) -> None:
    file = workbook(tmp_path / "a.xlsx", {"One": [["a", "b", "c"], [1.0], [2.0, 3.5]], "None": []})
    assert read_sheets(file) == {"One": [["a", "b", "c"], ["1", "", ""], ["2", "3.5", ""]], "None": []}


def test_the_spirobs_lengths_become_spools_and_its_joints_one_bend() -> None:
    table = {"time": [2.0, 2.5], "force_left": [1.0, 2.0], "force_right": [3.0, 4.0], "length_left": [200.0, 195.0],
             "length_right": [200.0, 206.0]} | {f"angle_{k}": [0.0, float(k)] for k in range(13)}  # fmt: skip
    log = spirob_log(Path("a.parquet"), table)
    np.testing.assert_allclose(log.columns["spool_1"], [0.0, 5e-3], atol=1e-12)
    np.testing.assert_allclose(log.columns["spool_2"], [0.0, -6e-3], atol=1e-12)
    np.testing.assert_allclose(log.columns["bend_y"], [0.0, np.radians(78.0)])
    assert log.columns["time"].tolist() == [0.0, 0.5] and log.columns["tension_2"].tolist() == [3.0, 4.0]
    with pytest.raises(UserError, match="0 forces, 0 lengths"):
        spirob_log(Path("a.parquet"), {"time": [0.0]})


@pytest.mark.parametrize(("turn", "paid_out"), [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)])
def test_the_spirobs_columns_are_those_of_its_authors_beside_commands_and_markers(
    tmp_path: Path, turn: float, paid_out: float
) -> None:
    time = np.linspace(0.0, 2.0, 50)
    swing = np.sin(3.0 * time)
    joints = {f"joint_{k}_deg": turn * (0.5 * k * swing) for k in range(1, 14)}
    table: dict[str, np.ndarray] = {"frame": np.arange(50.0), "video_timestamp_s": time}
    table |= {f"{name}_{k}": 100.0 + k + swing for name in ("x", "y", "angle_deg") for k in range(14)}
    table |= joints | {"global_timestamp_s": time + 12.5}
    table |= {f"cmd_force_{k}_N": 5.0 + side * np.sign(swing) for k, side in ((0, 1.0), (1, -1.0))}
    table |= {f"meas_force_{k}_N": 5.0 + 2.0 * side * swing for k, side in ((0, 1.0), (1, -1.0))}
    table |= {f"meas_length_{k}_mm": 210.0 - paid_out * side * 8.0 * swing for k, side in ((0, 1.0), (1, -1.0))}
    file = tmp_path / "spirob_tendon_trajectory_60s.csv"
    heads, cells = ",".join(table), np.stack(list(table.values()), axis=1)
    put(tmp_path, file.name, heads, *(",".join(f"{cell:.6f}" for cell in row) for row in cells))
    log = read_log(file, "spirob")
    np.testing.assert_allclose(log.columns["bend_y"], np.radians(0.5 * 91 * swing), atol=1e-6)
    np.testing.assert_allclose(log.columns["time"], time, atol=1e-5)
    np.testing.assert_allclose(log.columns["spool_1"], 8e-3 * swing, atol=1e-8)
    np.testing.assert_allclose(log.columns["spool_2"], -8e-3 * swing, atol=1e-8)
    np.testing.assert_allclose(log.columns["tension_1"], 5.0 + 2.0 * swing, atol=1e-6)
    ringing = put(tmp_path, "spirob_messung.csv", "t_us,frame_id,accX,accY,accZ", "731515359,584614,1.0,0.0,0.0")
    with pytest.raises(UserError, match="0 forces, 0 lengths, 0 angles"):
        read_log(ringing, "spirob")
