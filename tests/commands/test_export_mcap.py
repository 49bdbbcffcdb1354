"""Motions and tables as ROS 2 messages in MCAP, decoded by MCAP's own readers, and read back by ours."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from tests.commands.made_motions import BEGINS, compared, rig_run, simulated
from wristctl.commands.export.run_data import export_run
from wristctl.errors import UserError
from wristctl.records import Run, start_run
from wristctl.records.log_converters import read_log
from wristctl.study_files.load import load_study

Messages = dict[str, list[tuple[float, Any]]]


def decoded(file: Path) -> Messages:
    """Time [s] and message of each topic, by the decoder of MCAP's authors."""
    reader, ros = pytest.importorskip("mcap.reader"), pytest.importorskip("mcap_ros2.decoder")
    found: Messages = {}
    with file.open("rb") as stream:
        opened = reader.make_reader(stream, decoder_factories=[ros.DecoderFactory()])
        for _, channel, message, content in opened.iter_decoded_messages():
            found.setdefault(channel.topic, []).append((message.log_time * 1e-9, content))
    return found


def stamp(message: Any) -> float:
    return float(message.header.stamp.sec) + 1e-9 * float(message.header.stamp.nanosec)


def test_motions_are_joints_and_poses_on_the_runs_clock(tmp_path: Path) -> None:
    run = rig_run(tmp_path)
    found = decoded(export_run(run, "mcap", tmp_path / "a.mcap"))
    step, begin = run.config.hw_run.actuator.step_length, BEGINS[1]
    second, tendons = found["/tendons"][20]
    assert list(tendons.name) == ["spool_1", "spool_2", "spool_4", "spool_5"] and stamp(tendons) == second
    np.testing.assert_allclose(tendons.position, step * (10.0 * np.array([1, 2, 4, 5]) + 20.0))
    assert second == pytest.approx(begin + 1e-5) and not len(tendons.effort)
    second, commands = found["/commands"][3]
    assert second == pytest.approx(BEGINS[0] + 0.03) and commands.position[0] == pytest.approx(13.5 * step)
    assert found["/reference"][25][1].name == ["bend_z"] and found["/bend"][0][1].name == ["bend_y"]
    assert [word.data for _, word in found["/trial"]] == ["0", "1"]
    np.testing.assert_allclose([at for at, _ in found["/trial"]], np.array(BEGINS) + 1e-5)
    second, pose = found["/tip"][9]  # second picture of the second trial, toward flexion by 1 rad
    assert second == pytest.approx(begin + 0.029) and pose.header.frame_id == "wrist_base"
    place, turn = pose.pose.position, pose.pose.orientation
    assert (place.x, place.y, place.z) == (0.08, 0.0, pytest.approx(0.09))
    # Turned about -y by 1 rad, x leans toward +z.
    np.testing.assert_allclose([turn.x, turn.y, turn.z, turn.w], [0.0, -np.sin(0.5), 0.0, np.cos(0.5)], atol=1e-12)


def test_joints_of_the_urdf_bend_as_the_wrist_does(tmp_path: Path) -> None:
    found = decoded(export_run(rig_run(tmp_path), "mcap", tmp_path / "a.mcap"))["/joint_states"]
    assert list(found[0][1].name) == [f"hinge{k}{plane}" for k in range(1, 5) for plane in "yz"] and len(found) == 15
    # Toward ulnar in the first trial, toward flexion in the second, a quarter at each joint.
    np.testing.assert_allclose(found[2][1].position, [0.075, 0.0] * 4, atol=1e-12)
    np.testing.assert_allclose(found[9][1].position, [0.0, 0.25] * 4, atol=1e-12)


def test_every_table_over_time_is_a_topic_whose_definition_has_units(tmp_path: Path) -> None:
    reader = pytest.importorskip("mcap.reader")
    file = export_run(rig_run(tmp_path), "mcap", tmp_path / "a.mcap")
    rows = decoded(file)["/hw_run/log"]
    assert len(rows) == 40 and rows[39][1].theta_ref == pytest.approx(0.2 * 0.19) and rows[39][1].trial == 1
    with file.open("rb") as stream:
        summary = reader.make_reader(stream).get_summary()
    assert summary is not None
    (schema,) = (each for each in summary.schemas.values() if each.name == "wristctl_msgs/msg/HwRunLog")
    assert b"float64 theta_ref  # [rad] reference that the controller follows" in schema.data
    assert {channel.message_encoding for channel in summary.channels.values()} == {"cdr"}


@pytest.mark.parametrize("made", [rig_run, simulated, compared])
def test_its_samples_come_back(made: Any, tmp_path: Path) -> None:
    run = made(tmp_path)
    log = read_log(export_run(run, "csv", tmp_path / "log.csv")).trials()
    back = read_log(export_run(run, "mcap", tmp_path / "a.mcap")).trials()
    assert list(log) == list(back)
    for name, trial in log.items():
        other = back[name]
        assert len(trial) == len(other)
        np.testing.assert_allclose(np.diff(trial.columns["time"]), np.diff(other.columns["time"]), atol=2e-9)
        for column, values in trial.columns.items():
            if column in ("time", "mass"):
                continue
            there = np.isfinite(values)  # a pose has three numbers, where one camera sees two
            np.testing.assert_array_equal(values[there], other.columns[column][there], err_msg=column)


def test_pictures_are_compressed_images(tmp_path: Path) -> None:
    film = decoded(export_run(rig_run(tmp_path, film=True), "mcap", tmp_path / "a.mcap"))["/camera/compressed"]
    assert len(film) == 16
    for number, (second, image) in enumerate(film):
        picture = cv2.imdecode(np.frombuffer(bytes(image.data), np.uint8), cv2.IMREAD_GRAYSCALE)
        assert picture is not None and picture.shape == (48, 64) and image.format == "jpeg"
        assert abs(picture.mean() - (40.0 if number < 8 else 200.0)) < 3.0 and stamp(image) == pytest.approx(second)


def test_a_bag_of_another_robot_with_such_joints_needs_no_names(tmp_path: Path) -> None:
    from tests.records.test_ros_bags import bag

    def joints(name: str, position: float) -> Any:
        return lambda types, header: types["sensor_msgs/msg/JointState"](
            header, [name], np.array([position]), np.empty(0), np.array([7.0])
        )

    kind = "sensor_msgs/msg/JointState"
    messages = [("/robot/joint_states", kind, k * 10**7, joints("spool_1", 1e-3 * k)) for k in range(3)]
    messages += [("/robot/joint_commands", kind, k * 10**7, joints("spool_1", 9.0)) for k in range(3)]
    log = read_log(bag(tmp_path, True, messages))
    np.testing.assert_allclose(log.columns["spool_1"], [0.0, 1e-3, 2e-3])
    np.testing.assert_allclose(log.columns["tension_1"], 7.0)


def test_a_run_without_time_is_refused_and_leaves_no_file(tmp_path: Path) -> None:
    with start_run("train", load_study(), "", tmp_path) as live:
        live.table("data/curves.csv", {"epoch": np.arange(3)})
    with pytest.raises(UserError, match="nothing in that train run went on in time"):
        export_run(Run(live.path), "mcap", tmp_path / "b.mcap")
    assert not (tmp_path / "b.mcap").exists()
